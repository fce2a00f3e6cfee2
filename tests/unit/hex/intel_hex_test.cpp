#include "hex/intel_hex.hpp"

#include <gtest/gtest.h>

#include <string>
#include <tuple>
#include <vector>

namespace swarmtalk::hex {
namespace {

constexpr const char* kEnd = ":00000001FF\n";

TEST(IntelHex, TellsAddressBytesAndLineOfEachDataRecord) {
  const IntelHex file = parse_intel_hex(":0400100001020304E2\r\n\r\n:01000000ff00\n:00000001FF");
  EXPECT_EQ(file.problem, "");
  ASSERT_EQ(file.blocks.size(), 2u);
  EXPECT_EQ(file.blocks[0].address, 0x10u);
  EXPECT_EQ(file.blocks[0].bytes, (std::vector<std::uint8_t>{1, 2, 3, 4}));
  EXPECT_EQ(file.blocks[0].line, 1u);
  EXPECT_EQ(file.blocks[1].bytes, (std::vector<std::uint8_t>{0xFF}));
  EXPECT_EQ(file.blocks[1].line, 3u);
}

TEST(IntelHex, AddsTheBaseThatCameLast) {
  const IntelHex file = parse_intel_hex(
      std::string(":020000021000EC\n:0100020007F6\n:020000040001F9\n:0100020007F6\n") + kEnd);
  ASSERT_EQ(file.problem, "");
  EXPECT_EQ(file.blocks[0].address, 0x10002u);
  EXPECT_EQ(file.blocks[1].address, 0x10002u);
}

TEST(IntelHex, TellsTheFirstThingThatIsWrongWithItsLineAndGivesNothing) {
  for (const auto& [text, problem] : std::vector<std::pair<std::string, std::string>>{
           {":01000000ff01\n", "line 1: the checksum is wrong"},
           {":01000000ff00\n:0g\n",
            "line 2: a record is pairs of hexadecimal digits; a comment needs a line of its own"},
           {":01000000ff0\n",
            "line 1: a record is pairs of hexadecimal digits; a comment needs a line of its own"},
           {":02000000ff00\n", "line 1: the record is not as long as it says"},
           {":01000000ff00\n\nhello\n", "line 3: a record begins with ':'"},
           {":01000000ff00\nS00C0000\n", "line 2: a record begins with ':'"},
           {":01000000ff00\n;01000100fe00\n", "line 2: a record begins with ':'"},
           {":01000000ff00\n#0400100001020304E2\n", "line 2: a record begins with ':'"},
           {":01000000ff 00\n",
            "line 1: a record is pairs of hexadecimal digits; a comment needs a line of its own"},
           {std::string(":01000000ff00\0\n", 15),
            "line 1: a record is pairs of hexadecimal digits; a comment needs a line of its own"},
           {std::string(":01000000ff00\n\x1A"), "line 2: a record begins with ':'"},
           {":0100000400FB\n", "line 1: a base address has two bytes"},
           {":00000009F7\n", "line 1: record type 9 is not known"},
           {std::string(kEnd) + kEnd, "line 2: there is more after the end record"},
           {":01000000ff00\n", "it has no end record (:00000001FF): the file is cut short"},
           {"", "it has no end record (:00000001FF): the file is cut short"}}) {
    const IntelHex file = parse_intel_hex(text);
    EXPECT_EQ(file.problem, problem) << text;
    EXPECT_TRUE(file.blocks.empty()) << text;
  }
}

TEST(IntelHex, PassesOverWhatEditorsAndShellsDoToAFile) {
  const std::string one = ":0400100001020304E2", two = ":01000000ff00", end = ":00000001FF";
  const std::string whole = one + "\n" + two + "\n" + end + "\n";
  for (const auto& [name, text, line_of_two] :
       std::vector<std::tuple<std::string, std::string, std::size_t>>{
           {"byte order mark", "\xEF\xBB\xBF" + whole, 2},
           {"blanks around", " " + one + " \t\n\t" + two + "\t\r\n  " + end + " \n", 2},
           {"lines of blanks", one + "\n  \n\t\n" + two + "\n\n" + end, 4},
           {"CR CR LF", one + "\r\r\n" + two + "\r\r\n" + end + "\r\r\n", 2},
           {"CR", one + "\r" + two + "\r" + end + "\r", 2},
           {"CR and empty lines", one + "\r\r\r" + two + "\r" + end, 4},
           {"all ends in one file", one + "\r\n" + two + "\r" + end + "\n", 2},
           {"comments", "; of me\n" + one + "\n# two:\n" + two + "\n" + end + "\n;\n", 4},
           {"Ctrl-Z", whole + "\x1A", 2},
           {"zeros", whole + std::string(64, '\0'), 2},
           {"Ctrl-Z and zeros in the end's line",
            one + "\n" + two + "\n" + end + "\n \x1A" + std::string(3, '\0') + "\r\n \n", 2}}) {
    const IntelHex file = parse_intel_hex(text);
    EXPECT_EQ(file.problem, "") << name;
    ASSERT_EQ(file.blocks.size(), 2u) << name;
    EXPECT_EQ(file.blocks[0].bytes, (std::vector<std::uint8_t>{1, 2, 3, 4})) << name;
    EXPECT_EQ(file.blocks[1].line, line_of_two) << name;
  }
}

TEST(IntelHex, OfAnotherKindOfFileSaysWhatMakesOne) {
  for (const std::string& text :
       {std::string("\x7F"
                    "ELF\x01\x01\x01"),
        std::string("S00C0000702E73726563C1\r\n"), std::string("<!DOCTYPE html>\n"),
        std::string("\x0C\x94\x34\x00", 4)}) {
    const std::string problem = parse_intel_hex(text).problem;
    EXPECT_TRUE(problem.starts_with("line 1: this is not an Intel HEX file")) << problem;
    EXPECT_NE(problem.find("`avr-objcopy -O ihex "), std::string::npos) << problem;
  }
  std::string wide;
  for (const char c : std::string(":00000001FF\n")) wide += {c, '\0'};
  EXPECT_EQ(parse_intel_hex(wide).problem, "it is UTF-16; save it as UTF-8");
  EXPECT_EQ(parse_intel_hex("\xFF\xFE" + wide).problem, "it is UTF-16; save it as UTF-8");
}

TEST(IntelHex, KnowsWhatIsNotForTheProgramsFlash) {
  for (const auto& [address, what] :
       std::vector<std::pair<std::uint32_t, std::string>>{{0x810000, "EEPROM"},
                                                          {0x810002, "EEPROM"},
                                                          {0x820000, "fuses"},
                                                          {0x83FFFF, "lock bits"},
                                                          {0x840000, "signature"}}) {
    const std::string problem = beside_program_problem({address, {1}, 13});
    EXPECT_TRUE(problem.starts_with("line 13: ")) << problem;
    EXPECT_NE(problem.find(what), std::string::npos) << problem;
    EXPECT_NE(problem.find("`avr-objcopy -O ihex -R .eeprom -R .fuse -R .lock"), std::string::npos)
        << problem;
  }
  for (const std::uint32_t address : {0u, 0x7FFFu, 0x80FFFFu, 0x850000u, 0xFFFFFFFFu}) {
    EXPECT_EQ(beside_program_problem({address, {1}, 1}), "") << address;
  }
}

}  // namespace
}  // namespace swarmtalk::hex
