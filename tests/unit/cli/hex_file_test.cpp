#include "cli/kilobot/hex_file.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

namespace swarmtalk::cli {
namespace {

/// A record with its checksum.
std::string record(unsigned address, unsigned type, const std::vector<unsigned>& bytes) {
  char text[16];
  std::snprintf(text, sizeof text, ":%02zX%04X%02X", bytes.size(), address, type);
  std::string line = text;
  unsigned sum = static_cast<unsigned>(bytes.size()) + (address >> 8) + (address & 0xFF) + type;
  for (const unsigned byte : bytes) {
    std::snprintf(text, sizeof text, "%02X", byte);
    line += text;
    sum += byte;
  }
  std::snprintf(text, sizeof text, "%02X\n", (0x100 - (sum & 0xFF)) & 0xFF);
  return line + text;
}

const std::string kEndRecord = ":00000001FF\n";

std::string problem(const std::string& text) {
  const HexImage image = parse_hex_file(text);
  EXPECT_TRUE(image.bytes.empty()) << "a bad file gives bytes";
  return image.problem;
}

TEST(HexFile, ReadsRecordsInAnyOrderAndFillsGapsLikeErasedFlash) {
  const HexImage image = parse_hex_file(record(4, 0, {5, 6}) + record(0, 0, {1, 2}) + kEndRecord);
  EXPECT_EQ(image.problem, "");
  EXPECT_EQ(image.bytes, (std::vector<std::uint8_t>{1, 2, 0xFF, 0xFF, 5, 6}));
}

TEST(HexFile, TakesCarriageReturnsEmptyLinesStartAddressesAndEqualOverlap) {
  std::string text = record(0, 0, {1, 2}) + "\n" + record(1, 0, {2, 3}) +
                     record(0, 3, {0, 0, 0, 0}) + record(0, 5, {0, 0, 0, 0}) + kEndRecord;
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2)
    text.insert(at, "\r");
  const HexImage image = parse_hex_file(text);
  EXPECT_EQ(image.problem, "");
  EXPECT_EQ(image.bytes, (std::vector<std::uint8_t>{1, 2, 3}));
}

TEST(HexFile, AddsBaseAddresses) {
  const HexImage image = parse_hex_file(record(0, 2, {0x01, 0x00}) + record(2, 0, {7}) +
                                        record(0, 4, {0, 0}) + record(0, 0, {1}) + kEndRecord);
  ASSERT_EQ(image.problem, "");
  ASSERT_EQ(image.bytes.size(), 0x1003u);
  EXPECT_EQ(image.bytes[0x1002], 7);
}

TEST(HexFile, TellsWhatIsWrongAndWhere) {
  const std::string good = record(0, 0, {1, 2});
  std::string bad_sum = good;
  bad_sum[bad_sum.size() - 2] = bad_sum[bad_sum.size() - 2] == '0' ? '1' : '0';
  EXPECT_EQ(problem(good + bad_sum + kEndRecord), "line 2: the checksum is wrong");
  EXPECT_NE(problem(good).find("no end record"), std::string::npos);
  EXPECT_NE(
      problem(good + record(1, 0, {9}) + kEndRecord).find("line 2: address 0x0001 has another"),
      std::string::npos);
  EXPECT_NE(problem(record(0x6DFF, 0, {1, 2}) + kEndRecord).find("0x6e00"), std::string::npos);
  EXPECT_NE(problem(record(0, 4, {0, 1}) + record(0, 0, {1}) + kEndRecord).find("0x10000"),
            std::string::npos);
  EXPECT_NE(problem("hello\n").find("line 1: this is not"), std::string::npos);
  EXPECT_NE(problem(":0100000001\n" + kEndRecord).find("not as long"), std::string::npos);
  EXPECT_NE(problem(":00\n").find("not as long"), std::string::npos);
  EXPECT_NE(problem(":0x\n").find("pairs"), std::string::npos);
  EXPECT_NE(problem(record(0, 9, {}) + kEndRecord).find("type 9"), std::string::npos);
  EXPECT_NE(problem(kEndRecord + good).find("after the end"), std::string::npos);
  EXPECT_EQ(problem(kEndRecord), "it holds no program");
  EXPECT_NE(problem("").find("no end record"), std::string::npos);
}

TEST(HexFile, RefusesWhatIsNotForTheFlashWithTheCommandThatLeavesItOut) {
  const std::string why =
      problem(record(0, 0, {1}) + record(0, 4, {0, 0x81}) + record(2, 0, {7}) + kEndRecord);
  EXPECT_TRUE(why.starts_with("line 3: ")) << why;
  EXPECT_NE(why.find("EEPROM"), std::string::npos) << why;
  EXPECT_NE(why.find("-R .eeprom -R .fuse -R .lock"), std::string::npos) << why;
}

TEST(HexFile, TakesTheLastByteOfTheProgramAreaAndNoMore) {
  EXPECT_EQ(parse_hex_file(record(0x6DFE, 0, {1, 2}) + kEndRecord).bytes.size(), 28160u);
}

/// A table whose entries lead to one place, but for those given: JMP, or RJMP and NOP.
std::vector<std::uint8_t> table(const std::map<std::size_t, unsigned>& used, bool is_short) {
  std::vector<std::uint8_t> bytes;
  for (unsigned entry = 0; entry < 26; ++entry) {
    const auto found = used.find(entry);
    const unsigned target = found != used.end() ? found->second : 0x3FF0;
    const unsigned first = is_short ? 0xC000 | ((target - (2 * entry + 1)) & 0x0FFF) : 0x940C;
    const unsigned second = is_short ? 0 : target;
    for (const unsigned word : {first, second}) {
      bytes.push_back(static_cast<std::uint8_t>(word));
      bytes.push_back(static_cast<std::uint8_t>(word >> 8));
    }
  }
  return bytes;
}

TEST(KilobotProgram, HandlesTheAnalogComparatorsInterrupt) {
  for (const bool is_short : {false, true}) {
    EXPECT_EQ(why_no_kilobot_program(table({{0, 0x34}, {23, 0x200}}, is_short)), "");
    EXPECT_EQ(why_no_kilobot_program(table({{0, 0x34}, {13, 0x50}, {23, 0x60}}, is_short)), "");
    for (const std::size_t other : {std::size_t{0}, std::size_t{16}, std::size_t{22}}) {
      EXPECT_NE(why_no_kilobot_program(table({{other, 0x200}}, is_short)).find("no infrared light"),
                std::string::npos)
          << other;
    }
  }
}

TEST(KilobotProgram, BeginsWithAWholeTable) {
  std::vector<std::uint8_t> bytes = table({{23, 0x200}}, false);
  bytes[4 * 7] = 0;
  EXPECT_NE(why_no_kilobot_program(bytes).find("does not begin with the interrupt table"),
            std::string::npos);
  bytes = table({{23, 0x200}}, false);
  bytes.pop_back();
  EXPECT_NE(why_no_kilobot_program(bytes).find("too short"), std::string::npos);
}

}  // namespace
}  // namespace swarmtalk::cli
