#include "swarmtalk/bits.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace swarmtalk::core::bits {
namespace {

TEST(BitField, ReadsAcrossBytesMostSignificantBitFirst) {
  const uint8_t bytes[] = {0b10110011, 0b01010101, 0b11110000};
  EXPECT_EQ((Field<0, 1>::get(bytes)), 1);
  EXPECT_EQ((Field<1, 3>::get(bytes)), 0b011);
  EXPECT_EQ((Field<6, 4>::get(bytes)), 0b1101);
  EXPECT_EQ((Field<7, 10>::get(bytes)), 0b1010101011);
  EXPECT_EQ((Field<0, 24>::get(bytes)), 0xB355F0u);
}

TEST(BitField, WritesItsBitsAndNoOthers) {
  uint8_t bytes[] = {0xFF, 0xFF, 0xFF};
  Field<6, 5>::put(bytes, 0);
  EXPECT_EQ(bytes[0], 0xFC);
  EXPECT_EQ(bytes[1], 0x1F);
  EXPECT_EQ(bytes[2], 0xFF);
  memset(bytes, 0, 3);
  Field<6, 5>::put(bytes, 0xFF);
  EXPECT_EQ(bytes[0], 0x03);
  EXPECT_EQ(bytes[1], 0xE0) << "a value is cut to the field's width";
  EXPECT_EQ(bytes[2], 0);
}

TEST(BitField, HoldsEveryBitOfTheWidestValue) {
  uint8_t bytes[5] = {};
  Field<3, 32>::put(bytes, 0xDEADBEEF);
  EXPECT_EQ((Field<3, 32>::get(bytes)), 0xDEADBEEFu);
  EXPECT_EQ(bytes[0] >> 5, 0);
  EXPECT_EQ(bytes[4] & 0x1F, 0);
}

TEST(BitField, ThatAProfileLeavesOutReadsAsZeroAndWritesNothing) {
  uint8_t byte = 0xA5;
  Field<4, 0>::put(&byte, 0xFF);
  EXPECT_EQ(byte, 0xA5);
  EXPECT_EQ((Field<4, 0>::get(&byte)), 0);
}

}  // namespace
}  // namespace swarmtalk::core::bits
