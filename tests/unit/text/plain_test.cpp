#include "text/plain.hpp"

#include <gtest/gtest.h>

#include <cstdio>

#include <string>

namespace swarmtalk::text {
namespace {

TEST(PlainText, KeepsWhatShowsAsItself) {
  for (const char* text :
       {"", "robot 7", "gr\u00FC\u00DFe \u20AC \U0001F916", "\u0645\u0631\u062D"}) {
    EXPECT_TRUE(is_plain_text(text)) << text;
    EXPECT_EQ(plain(text), text);
  }
}

TEST(PlainText, EscapesWhatSteersATerminal) {
  EXPECT_EQ(plain("a\n\x1b[2J\x7f"), "a\\n\\u001b[2J\\u007f");
  EXPECT_EQ(plain("\u009b31m"), "\\u009b31m");
  EXPECT_EQ(plain(std::string_view("\0", 1)), "\\u0000");
}

TEST(PlainText, EscapesWhatChangesDirectionOrCannotBeSeen) {
  EXPECT_EQ(plain("\u202Eexe"), "\\u202eexe");
  EXPECT_EQ(plain("\u200F\u061C\u2066\u2069"), "\\u200f\\u061c\\u2066\\u2069");
  EXPECT_EQ(plain("\u2028\u2029"), "\\u2028\\u2029");
  EXPECT_EQ(plain("a\u200Bb\uFEFF"), "a\\u200bb\\ufeff");
  EXPECT_EQ(plain("\U000E0041"), "\\udb40\\udc41") << "the two halves that JSON has for it";
}

TEST(PlainText, NoCodePointOfTheForbiddenRangesIsPlain) {
  const auto all_escaped = [](std::uint32_t first, std::uint32_t last) {
    for (std::uint32_t code = first; code <= last; ++code) EXPECT_FALSE(is_plain(code)) << code;
  };
  all_escaped(0, 0x1F);
  all_escaped(0x7F, 0x9F);
  all_escaped(0x200B, 0x200F);
  all_escaped(0x2028, 0x202E);
  all_escaped(0x2066, 0x2069);
  EXPECT_TRUE(is_plain(0x20));
  EXPECT_TRUE(is_plain(0xA0));
  EXPECT_TRUE(is_plain(0x2010));
  EXPECT_TRUE(is_plain(0x10FFFF));
}

TEST(PlainText, BytesThatAreNotUtf8AreShownAsBytes) {
  EXPECT_EQ(plain("a\xff\xfe"), "a\\xff\\xfe");
  EXPECT_EQ(plain("\xed\xa0\x80"), "\\xed\\xa0\\x80");
  EXPECT_FALSE(is_plain_text("\xff\xfe"));
}

TEST(PlainText, LinesKeepTheirEndsAndNothingElse) {
  EXPECT_EQ(plain_lines("a\r\nb\n"), "a\\r\nb\n");
}

TEST(PlainText, ANameCannotEndItsOwnQuotes) {
  EXPECT_EQ(quoted("x' (pid 1, uid 0) closed: 'y"), R"('x\' (pid 1, uid 0) closed: \'y')");
  EXPECT_EQ(quoted("a\\'"), R"('a\\\'')");
  EXPECT_EQ(quoted("say \"x\"", '"'), R"("say \"x\"")");
}

TEST(PlainText, OnlyANameOfOneWordStandsWithoutQuotes) {
  EXPECT_EQ(shown_name("swarmtalk-cli"), "swarmtalk-cli");
  EXPECT_EQ(shown_name("gr\u00FCn"), "gr\u00FCn");
  EXPECT_EQ(shown_name("wlan0  delay 3 us"), "\"wlan0  delay 3 us\"");
  EXPECT_EQ(shown_name("a\u202Eb"), "\"a\\u202eb\"");
  EXPECT_EQ(shown_name(""), "\"\"");
}

TEST(PlainText, AShellTakesAWordAsItIs) {
  EXPECT_EQ(shell_word("/etc/swarmtalk/swarm.key"), "/etc/swarmtalk/swarm.key");
  for (const std::string word :
       {"my files/key", "it's", "$HOME", "a;b", "`id`", "'", "", "~", "*"}) {
    FILE* const shell = ::popen(("printf %s " + shell_word(word)).c_str(), "r");
    ASSERT_NE(shell, nullptr);
    std::string printed;
    for (int c = std::fgetc(shell); c != EOF; c = std::fgetc(shell))
      printed += static_cast<char>(c);
    ::pclose(shell);
    EXPECT_EQ(printed, word);
  }
}

}  // namespace
}  // namespace swarmtalk::text
