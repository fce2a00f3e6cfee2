#include "recording/crc32.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::recording {
namespace {

TEST(Crc32, HasTheCheckValueOfItsCatalogue) {
  EXPECT_EQ(crc32("123456789"), UINT32_C(0xCBF43926));
  EXPECT_EQ(crc32(""), 0u);
}

TEST(Crc32, GoesOnWhereItEnded) {
  EXPECT_EQ(crc32("6789", crc32("12345")), UINT32_C(0xCBF43926));
}

}  // namespace
}  // namespace swarmtalk::recording
