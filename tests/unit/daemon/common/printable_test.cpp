// What comes from outside, made fit for a line.
#include "daemon/common/printable.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

TEST(Printable, KeepsTextAsItIs) {
  EXPECT_EQ(printable("gr\u00FC\u00DFe \u20AC \U0001F916"), "gr\u00FC\u00DFe \u20AC \U0001F916");
}

TEST(Printable, ControlCharactersBecomeQuestionMarks) {
  EXPECT_EQ(printable("a\n\x1b[1m\x7f"), "a??[1m?");
}

TEST(Printable, WhatSteersATerminalOrCannotBeSeenBecomesAQuestionMark) {
  EXPECT_EQ(printable("\u009b31m\u202Ex\u200B"), "?31m?x?");
}

TEST(Printable, BytesThatAreNoUtf8BecomeQuestionMarks) {
  EXPECT_EQ(printable("\xff\xfe"), "??");
  EXPECT_EQ(printable("a\xc3"), "a?");               // cut short
  EXPECT_EQ(printable("\xc0\xaf"), "??");            // overlong
  EXPECT_EQ(printable("\xed\xa0\x80"), "???");       // a surrogate
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "????");  // beyond U+10FFFF
  EXPECT_EQ(printable("\xe0\x80\x80\u00FC"), "???\u00FC");
}

TEST(Printable, IsCutBetweenTwoCharacters) {
  EXPECT_EQ(printable("abcdef", 6), "abcdef");
  EXPECT_EQ(printable("abcdefg", 6), "abcdef...");
  EXPECT_EQ(printable("abcde\u00FC", 6), "abcde...");
  EXPECT_EQ(printable("abcd\u00FC", 6), "abcd\u00FC");
}

}  // namespace
}  // namespace swarmtalk::daemon
