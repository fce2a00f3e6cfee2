#include "swarmtalk/types.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::core {
namespace {

TEST(Types, TakeTheNarrowestIntegerThatHoldsTheBits) {
  EXPECT_EQ(sizeof(UintFor<0>), 1u);
  EXPECT_EQ(sizeof(UintFor<8>), 1u);
  EXPECT_EQ(sizeof(UintFor<9>), 2u);
  EXPECT_EQ(sizeof(UintFor<16>), 2u);
  EXPECT_EQ(sizeof(UintFor<17>), 4u);
  EXPECT_EQ(sizeof(UintFor<33>), 8u);
  EXPECT_EQ(sizeof(UintFor<64>), 8u);
}

TEST(Types, CountTheBitsOfTheLargestNumber) {
  EXPECT_EQ(bits_for(0), 0);
  EXPECT_EQ(bits_for(1), 1);
  EXPECT_EQ(bits_for(255), 8);
  EXPECT_EQ(bits_for(256), 9);
  EXPECT_EQ(bits_for(0xFFFFFFFF), 32);
}

TEST(Types, FillLowBitsUpToThirtyTwo) {
  EXPECT_EQ(low_bits(0), 0u);
  EXPECT_EQ(low_bits(1), 1u);
  EXPECT_EQ(low_bits(31), 0x7FFFFFFFu);
  EXPECT_EQ(low_bits(32), 0xFFFFFFFFu);
  EXPECT_EQ(low_bits(40), 0xFFFFFFFFu);
}

}  // namespace
}  // namespace swarmtalk::core
