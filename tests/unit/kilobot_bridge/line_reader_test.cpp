#include "kilobot_bridge/line_reader.hpp"

#include <gtest/gtest.h>

#include <string_view>
#include <vector>

namespace swarmtalk::kilobot_bridge {
namespace {

class LineReaderTest : public testing::Test {
 protected:
  void put(std::string_view text) {
    reader.put({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  std::vector<std::string> lines;
  LineReader reader{[this](const std::string& line) { lines.push_back(line); }};
};

TEST_F(LineReaderTest, SplitsAtLineFeedsAndLeavesOutCarriageReturns) {
  put("on");
  put("e\r\ntwo\n\n\r\nthr");
  EXPECT_EQ(lines, (std::vector<std::string>{"one", "two"}));
}

TEST_F(LineReaderTest, CutsAndCountsLongLines) {
  put(std::string(1000, 'x') + "\nshort\n");
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0].size(), LineReader::kMostBytes);
  EXPECT_EQ(lines[1], "short");
  EXPECT_EQ(reader.counters().cut_lines, 1u);
}

TEST_F(LineReaderTest, ReplacesWhatIsNoUtf8) {
  put("a\xFF\xC3\xA4\xED\xA0\x80\xF0\x9F\x98\x80\xE2\x82\n");
  EXPECT_EQ(lines.at(0),
            "a\xEF\xBF\xBD\xC3\xA4\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\xF0\x9F\x98\x80"
            "\xEF\xBF\xBD\xEF\xBF\xBD");
}

TEST_F(LineReaderTest, ForgetsHalfALineThatWasInterrupted) {
  put("half");
  reader.on_interrupted();
  put("whole\n");
  EXPECT_EQ(lines, (std::vector<std::string>{"whole"}));
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
