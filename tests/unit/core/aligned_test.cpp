#include "swarmtalk/aligned.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

TEST(Aligned, HandsOnAlignedBytesWithoutACopy) {
  alignas(double) uint8_t bytes[40] = {1, 2, 3};
  const unsigned char* seen = nullptr;
  with_aligned<Kilobot>(bytes, 3, [&](unsigned char* message) { seen = message; });
  EXPECT_EQ(seen, bytes);
}

TEST(Aligned, CopiesBytesThatAreNot) {
  alignas(double) uint8_t bytes[48] = {};
  for (uint8_t shift = 1; shift < alignof(double); ++shift) {
    memset(bytes + shift, 7, 40);
    bool was_called = false;
    with_aligned<Kilobot>(bytes + shift, 40, [&](unsigned char* message) {
      was_called = true;
      EXPECT_EQ(reinterpret_cast<uintptr_t>(message) % alignof(double), 0u);
      EXPECT_EQ(memcmp(message, bytes + shift, 40), 0);
      message[0] = 9;  // a program may write to it
    });
    EXPECT_TRUE(was_called);
    EXPECT_EQ(bytes[shift], 7);
  }
}

}  // namespace
}  // namespace swarmtalk::core
