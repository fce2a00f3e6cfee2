#include "hex/digits.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::hex {
namespace {

TEST(Hex, EveryByteComesBack) {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
  EXPECT_EQ(from_hex(to_hex(bytes)), bytes);
}

TEST(Hex, ReadsTheFormsPeopleType) {
  EXPECT_EQ(from_hex("48:65:6C"), "Hel");
  EXPECT_EQ(from_hex("0x48 65 6c"), "Hel");
  EXPECT_EQ(from_hex("48\t65\r\n6c\r\n"), "Hel");
  EXPECT_EQ(from_hex(""), "");
}

TEST(Hex, RefusesHalfBytesAndOtherLetters) {
  EXPECT_FALSE(from_hex("4"));
  EXPECT_FALSE(from_hex("4 8"));
  EXPECT_FALSE(from_hex("zz"));
}

TEST(Hex, WritesTwoSmallDigitsOfEachByte) {
  EXPECT_EQ(to_hex("\x01\xAB\xFF"), "01abff");
  EXPECT_EQ(to_hex(""), "");
}

}  // namespace
}  // namespace swarmtalk::hex
