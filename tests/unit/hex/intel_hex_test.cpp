#include "hex/intel_hex.hpp"

#include <gtest/gtest.h>

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
           {":01000000ff00\n:0g\n", "line 2: a record is pairs of hexadecimal digits"},
           {":01000000ff0\n", "line 1: a record is pairs of hexadecimal digits"},
           {":02000000ff00\n", "line 1: the record is not as long as it says"},
           {"hello\n", "line 1: a record begins with ':'; this is not an Intel HEX file"},
           {":0100000400FB\n", "line 1: a base address has two bytes"},
           {":00000009F7\n", "line 1: record type 9 is not known"},
           {std::string(kEnd) + kEnd, "line 2: there is more behind the end record"},
           {":01000000ff00\n", "it has no end record (:00000001FF): the file is cut short"},
           {"", "it has no end record (:00000001FF): the file is cut short"}}) {
    const IntelHex file = parse_intel_hex(text);
    EXPECT_EQ(file.problem, problem) << text;
    EXPECT_TRUE(file.blocks.empty()) << text;
  }
}

}  // namespace
}  // namespace swarmtalk::hex
