#include "cli/text/hex.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::cli {
namespace {

TEST(Escaped, LeavesTextAsItIs) {
  EXPECT_EQ(escaped("Grüße \"x\""), "Grüße \"x\"");
}

TEST(Escaped, ShowsControlCharactersAsEscapes) {
  EXPECT_EQ(escaped("a\nb\tc\r"), "a\\nb\\tc\\r");
  EXPECT_EQ(escaped("\x1b[2J\x7f"), "\\u001b[2J\\u007f");
  EXPECT_EQ(escaped("\xC2\x9b"), "\\u009b");
  EXPECT_EQ(escaped("\u202Eexe"), "\\u202eexe");
  EXPECT_EQ(escaped("a\\nb"), "a\\\\nb") << "not to be taken for a line's end";
}

TEST(Escaped, RefusesWhatIsNoText) {
  EXPECT_FALSE(escaped("a\xff"));
}

}  // namespace
}  // namespace swarmtalk::cli
