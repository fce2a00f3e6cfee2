#include "text/encoding.hpp"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace swarmtalk::text {
namespace {

using std::string_view_literals::operator""sv;

TEST(Encoding, OfWideTextIsNamedWithTheRemedy) {
  for (const auto& [text, problem] : std::vector<std::pair<std::string_view, std::string>>{
           {"\xFF\xFE"sv, "is UTF-16; save it as UTF-8"},
           {"\xFF\xFE[\0n\0"sv, "is UTF-16; save it as UTF-8"},
           {"\xFE\xFF\0[\0n"sv, "is UTF-16; save it as UTF-8"},
           {"[\0n\0o\0"sv, "is UTF-16; save it as UTF-8"},
           {"\0[\0n\0o"sv, "is UTF-16; save it as UTF-8"},
           {"\r\0\n\0"sv, "is UTF-16; save it as UTF-8"},
           {"\xE4\0=\0"sv, "is UTF-16; save it as UTF-8"},
           {"\xFF\xFE\0\0[\0\0\0"sv, "is UTF-32; save it as UTF-8"},
           {"\0\0\xFE\xFF\0\0\0["sv, "is UTF-32; save it as UTF-8"},
           {"[\0\0\0n\0\0\0"sv, "is UTF-32; save it as UTF-8"},
           {"\0\0\0[\0\0\0n"sv, "is UTF-32; save it as UTF-8"}}) {
    EXPECT_EQ(encoding_problem(text), problem) << testing::PrintToString(text);
  }
}

TEST(Encoding, OfOtherTextIsNoProblem) {
  for (const std::string_view text :
       {""sv, "a"sv, "a = 1\n"sv, "\xEF\xBB\xBF[node]"sv, "\xC3\xA4 = 1"sv, "\xE4 = 1"sv, "a\0"sv,
        "\0\0\0\0"sv, "ab\0\0"sv,
        "\x7F"
        "ELF"sv}) {
    EXPECT_EQ(encoding_problem(text), "") << testing::PrintToString(text);
  }
}

TEST(Encoding, MarksAndReturnsAreNoPartOfTheText) {
  EXPECT_EQ(without_mark("\xEF\xBB\xBFgo"), "go");
  EXPECT_EQ(without_mark("\xEF\xBBgo"), "\xEF\xBBgo");
  EXPECT_EQ(without_mark("go\xEF\xBB\xBF"), "go\xEF\xBB\xBF");
  EXPECT_EQ(without_return("go\r"), "go");
  EXPECT_EQ(without_return("\rgo"), "\rgo");
  EXPECT_EQ(without_return("\r"), "");
  EXPECT_EQ(without_return(""), "");
  EXPECT_EQ(bare_return_problem("go"), "");
  EXPECT_NE(bare_return_problem("go\rgo"), "");
}

}  // namespace
}  // namespace swarmtalk::text
