#include "text/toml_text.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace swarmtalk::text {
namespace {

std::string converted(std::string_view text) {
  const AsciiToml ascii = to_ascii(text);
  EXPECT_EQ(ascii.line, 0u) << ascii.what;
  return ascii.text;
}

TEST(TomlText, HasEscapesForWhatIsNotAscii) {
  EXPECT_EQ(converted("a = \"\u00e9\U0001F916\"\n"), "a = \"\\U000000E9\\U0001F916\"\n");
  EXPECT_EQ(converted("a = \"\"\"\u00e9\n\u00e9\"\"\"\n"),
            "a = \"\"\"\\U000000E9\n\\U000000E9\"\"\"\n");
  EXPECT_EQ(converted("\"\u00e9\" = 'a\\\"\u00e9'"), "\"\\U000000E9\" = \"a\\\\\\\"\\U000000E9\"");
}

TEST(TomlText, LeavesOutCommentsAndTheByteOrderMark) {
  EXPECT_EQ(converted("\xEF\xBB\xBF# \u00e9\na = '#' # \u00e9 \"\n"), "\na = \"#\" \n");
}

TEST(TomlText, KnowsWhereStringsEnd) {
  EXPECT_EQ(converted("a = \"\\\\\" # \u00e9"), "a = \"\\\\\" ");
  EXPECT_EQ(converted("a = \"\\\"\" # \u00e9"), "a = \"\\\"\" ");
  EXPECT_EQ(converted("a = '\\' # \u00e9"), "a = \"\\\\\" ");
  EXPECT_EQ(converted("a = \"\"\"\"\"x\"\"\"\"\" # \u00e9"), "a = \"\"\"\"\"x\\\"\\\"\"\"\" ");
  EXPECT_EQ(converted("a = '''x'''' # \u00e9"), "a = \"\"\"x'\"\"\" ");
  EXPECT_EQ(converted("a = \"\" # \u00e9"), "a = \"\" ");
  EXPECT_EQ(converted("a = 'x'\"\""), "a = \"x\" \"\"") << "as wrong as it was";
}

TEST(TomlText, IsReadAsTheTextThatItWas) {
  const toml::table table =
      toml::parse(converted("a = \"\u20ac \\u20ac\"  # \u20ac\r\n"
                            "b = \"\"\"\\\n  \u3000x\"\"\"\r\n"
                            "\"\u00e9\" = 1\n"
                            "c = '''\n\\ \" ''\u00e9'''''\n"));
  EXPECT_EQ(table["a"].value_or(std::string()), "\u20ac \u20ac");
  EXPECT_EQ(table["b"].value_or(std::string()), "\u3000x");
  EXPECT_EQ(table["c"].value_or(std::string()), "\\ \" ''\u00e9''");
  EXPECT_EQ(table["\u00e9"].value_or(0), 1);
}

TEST(TomlText, NamesTheLineOfWhatMustNotBeThere) {
  EXPECT_EQ(to_ascii("a = 1\nb = \u00e9\n").line, 2u);
  EXPECT_EQ(to_ascii("a = \"\"\"\n\n\x01\"\"\"\n").line, 3u);
  EXPECT_EQ(to_ascii("a = \"\xff\"").line, 1u);
  EXPECT_EQ(to_ascii("\n# \x7f").line, 2u);
}

TEST(TomlText, InAnotherEncodingSaysWhichAndHasNoLine) {
  for (const std::string& text : {std::string("\xFF\xFE"
                                              "a\0=\0001\0",
                                              8),
                                  std::string("a\0=\0001\0", 6)}) {
    try {
      parse_toml(text, "a.toml");
      FAIL() << "it is taken";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "a.toml: is UTF-16; save it as UTF-8");
    }
  }
  EXPECT_EQ(parse_toml("\xEF\xBB\xBF"
                       "a = 1\r\n",
                       "a.toml")["a"]
                .value_or(0),
            1);
}

TEST(TomlText, OfAFileNamesItWithTheLine) {
  const std::string path = testing::TempDir() + "swarmtalk-toml-" + std::to_string(::getpid());
  const auto error_of = [&](const std::string& file) {
    try {
      parse_toml_file(file);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  std::ofstream(path) << "a = 1 # one\n";
  EXPECT_EQ(parse_toml_file(path)["a"].value_or(0), 1);
  std::ofstream(path) << "a = 1\nb = \"\n";
  EXPECT_EQ(error_of(path),
            path +
                ":2: not TOML: column 5: a text begins here with \" and has no second \" in "
                "its line; add it at its end");
  std::ofstream(path) << "a = 1\n\na = 2\n";
  EXPECT_EQ(error_of(path),
            path +
                ":3: not TOML: the key or section of this line is there twice; keep "
                "one of the two");
  std::ofstream(path) << "a = 1\nb = yes\n";
  EXPECT_NE(error_of(path).find(":2: not TOML: Error while parsing"), std::string::npos);
  EXPECT_NE(error_of(path).find("; if it is text, put it in double quotes"), std::string::npos);
  std::filesystem::remove(path);
  EXPECT_EQ(error_of(path), path + ": No such file or directory");
  EXPECT_EQ(error_of("/proc"), "/proc: Is a directory");
}

}  // namespace
}  // namespace swarmtalk::text
