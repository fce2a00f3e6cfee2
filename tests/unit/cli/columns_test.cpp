#include "cli/text/columns.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::cli {
namespace {

using Strings = std::vector<std::string>;

TEST(Columns, NumbersAreRightAndTextIsLeft) {
  EXPECT_EQ(columns({{"NAME", "N"}, {"a", "12"}}, "lr"), (Strings{"NAME   N", "a     12"}));
}

TEST(Columns, WhatDoesNotFitIsLeftOutFromTheRightAndCounted) {
  const std::vector<Strings> rows{{"NAME", "FIRST", "SECOND"}, {"a", "1", "2"}};
  EXPECT_EQ(columns(rows, "lrr", 16), (Strings{"NAME  FIRST +1", "a         1"}));
  EXPECT_EQ(columns(rows, "lrr", 14), (Strings{"NAME +2", "a"}));
  EXPECT_EQ(columns(rows, "lrr", 19), (Strings{"NAME  FIRST  SECOND", "a         1       2"}));
}

TEST(Columns, TheFirstColumnIsCutWhenItIsLong) {
  EXPECT_EQ(columns({{"CHANNEL", "N"}, {"a_long_channel", "1"}}, "lr", 12),
            (Strings{"CHANNEL    N", "a_long_c~  1"}));
}

TEST(Columns, CharactersAreNotCutInTwo) {
  EXPECT_EQ(clip("\xc3\xa4\xc3\xb6\xc3\xbc", 2), "\xc3\xa4~");
  EXPECT_EQ(width_of("\xc3\xa4\xc3\xb6"), 2u);
  EXPECT_EQ(clip("abc", 3), "abc");
  EXPECT_EQ(clip("abc", 0), "");
}

}  // namespace
}  // namespace swarmtalk::cli
