#include "daemon/hub/channel_table.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

TEST(ChannelTable, ConfiguredNameHasItsNumber) {
  const ChannelTable table({{"hello", 7}});
  EXPECT_EQ(table.find("hello").number, 7);
  EXPECT_EQ(table.find("hello").problem, "");
  EXPECT_EQ(table.name_of(7), "hello");
}

// Part of the protocol between robots: these numbers must never change.
TEST(ChannelTable, HashIsTheSameOnEveryRobot) {
  EXPECT_EQ(ChannelTable::hash("hello"), 58164);
  EXPECT_EQ(ChannelTable::hash("a"), 0x8000 | ((0xE40C292Cu >> 16 ^ 0xE40C292Cu) & 0x7FFF));
  EXPECT_EQ(ChannelTable::hash("foobar"), 0x8000 | ((0xBF9CF968u >> 16 ^ 0xBF9CF968u) & 0x7FFF));
}

TEST(ChannelTable, OtherNameIsHashedToTheUpperHalf) {
  const ChannelTable table({});
  const auto found = table.find("position");
  EXPECT_EQ(found.problem, "");
  EXPECT_GE(found.number, 0x8000);
  EXPECT_EQ(table.name_of(found.number), "");  // nobody uses it yet
}

TEST(ChannelTable, CollisionWithANameInUseNamesBoth) {
  // Search for two names of one number, as robots might meet them.
  std::unordered_map<std::uint16_t, std::string> seen;
  std::string first, second;
  for (int i = 0; second.empty(); ++i) {
    const std::string name = "n" + std::to_string(i);
    const auto [it, is_new] = seen.emplace(ChannelTable::hash(name), name);
    if (!is_new) first = it->second, second = name;
  }
  ChannelTable table({});
  const std::uint16_t number = table.find(first).number;
  table.hold(number, first);
  EXPECT_EQ(table.find(first).problem, "");
  const std::string problem = table.find(second).problem;
  EXPECT_NE(problem.find("'" + first + "'"), std::string::npos) << problem;
  EXPECT_NE(problem.find("'" + second + "'"), std::string::npos) << problem;
  table.hold(number, first);
  table.release(number, first);
  EXPECT_NE(table.find(second).problem, "");  // still held once
  table.release(number, first);
  EXPECT_EQ(table.find(second).problem, "");
}

TEST(ChannelTable, CollisionWithAConfiguredNumberIsRefused) {
  const ChannelTable table({{"mine", ChannelTable::hash("hello")}});
  const std::string problem = table.find("hello").problem;
  EXPECT_NE(problem.find("'mine'"), std::string::npos) << problem;
}

TEST(ChannelTable, ImpossibleNamesAreRefused) {
  const ChannelTable table({});
  EXPECT_NE(table.find("").problem, "");
  EXPECT_NE(table.find(std::string(65, 'x')).problem, "");
  EXPECT_NE(table.find("two\nlines").problem, "");
  EXPECT_EQ(table.find(std::string(64, 'x')).problem, "");
}

}  // namespace
}  // namespace swarmtalk::daemon
