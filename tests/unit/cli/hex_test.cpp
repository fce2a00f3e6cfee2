#include "cli/hex.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::cli {
namespace {

TEST(Hex, EveryByteComesBack) {
  std::string bytes;
  for (int i = 0; i < 256; ++i) bytes += static_cast<char>(i);
  EXPECT_EQ(from_hex(to_hex(bytes)), bytes);
}

TEST(Hex, ReadsTheFormsPeopleType) {
  EXPECT_EQ(from_hex("48:65:6C"), "Hel");
  EXPECT_EQ(from_hex("0x48 65 6c"), "Hel");
  EXPECT_EQ(from_hex(""), "");
}

TEST(Hex, RefusesHalfBytesAndOtherLetters) {
  EXPECT_FALSE(from_hex("4"));
  EXPECT_FALSE(from_hex("4 8"));
  EXPECT_FALSE(from_hex("zz"));
}

TEST(Utf8, AcceptsTheShortestAndLongestOfEachLength) {
  for (const char* text : {"", "\x7f", "\xC2\x80", "\xDF\xBF", "\xE0\xA0\x80", "\xEF\xBF\xBF",
                           "\xF0\x90\x80\x80", "\xF4\x8F\xBF\xBF"}) {
    EXPECT_TRUE(is_utf8(text)) << to_hex(text);
  }
}

TEST(Utf8, RefusesOverlongSurrogateCutAndTooLarge) {
  for (const char* text :
       {"\x80", "\xC0\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xE2\x82",
        "\xF0\x8F\xBF\xBF", "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xFF"}) {
    EXPECT_FALSE(is_utf8(text)) << to_hex(text);
  }
}

TEST(Utf8, ControlCharactersAreNotForATerminal) {
  EXPECT_TRUE(is_printable("Grüße"));
  EXPECT_FALSE(is_printable("a\nb"));
  EXPECT_FALSE(is_printable("\x1b[2J"));
  EXPECT_FALSE(is_printable("\xC2\x9b"));
}

}  // namespace
}  // namespace swarmtalk::cli
