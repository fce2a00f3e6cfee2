#include "text/counted.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::text {
namespace {

TEST(Counted, OneThingIsNotMany) {
  EXPECT_EQ(counted(0, "message"), "0 messages");
  EXPECT_EQ(counted(1, "message"), "1 message");
  EXPECT_EQ(counted(2, "message"), "2 messages");
  EXPECT_EQ(counted(1, "pass", "passes"), "1 pass");
  EXPECT_EQ(counted(UINT64_MAX, "pass", "passes"), "18446744073709551615 passes");
}

}  // namespace
}  // namespace swarmtalk::text
