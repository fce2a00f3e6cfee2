#include "swarmtalk/duplicate_cache.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

using Key = RecordKey<Kilobot>;
using Entry = Record<Kilobot>;

Key key(uint8_t node, uint8_t message, uint8_t channel = 1) {
  Wire<Kilobot>::Header header = {};
  header.node = node;
  header.message = message;
  header.channel = channel;
  uint8_t packet[Wire<Kilobot>::kHeaderBytes];
  Wire<Kilobot>::encode(header, packet);
  return Key(packet);
}

/// The cache, with the time as an argument of each call.
struct Cache : DuplicateCache<Kilobot> {
  using Base = DuplicateCache<Kilobot>;
  Base& at(uint16_t ticks) {
    set_now(ticks);
    return *this;
  }
};

TEST(DuplicateCache, KnowsMessagesByNodeNumberAndChannel) {
  Cache sut;
  const auto record = sut.at(0).insert(key(1, 2), true, true);
  EXPECT_EQ(sut.at(0).find(key(1, 2)), record);
  EXPECT_EQ(sut.at(0).find(key(1, 3)), nullptr);
  EXPECT_EQ(sut.at(0).find(key(2, 2)), nullptr);
  EXPECT_EQ(sut.at(0).find(key(1, 2, 3)), nullptr);
}

TEST(DuplicateCache, ForgetsOneHopMessagesSoonAndFloodsLate) {
  Cache sut;
  sut.at(60000).insert(key(1, 1), false, true);
  sut.at(60000).insert(key(2, 1), true, true);
  EXPECT_NE(sut.at(60008).find(key(1, 1)), nullptr);
  EXPECT_EQ(sut.at(60009).find(key(1, 1)), nullptr);
  const auto across_a_wrap = static_cast<uint16_t>(60000 + 990);
  EXPECT_NE(sut.at(across_a_wrap).find(key(2, 1)), nullptr);
  EXPECT_EQ(sut.at(static_cast<uint16_t>(60000 + 1016)).find(key(2, 1)), nullptr);
}

TEST(DuplicateCache, GivesAwayTheOldestClosedRecordAndNeverAnOpenOne) {
  Cache sut;
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    const auto record = sut.at(static_cast<uint16_t>(node * 8)).insert(key(node, 0), true, true);
    if (node != 3 && node != 4) sut.at(150).open(*record);
  }
  EXPECT_NE(sut.at(160).insert(key(100, 0), true, true), nullptr);
  EXPECT_EQ(sut.at(160).find(key(3, 0)), nullptr);
  EXPECT_NE(sut.at(160).find(key(4, 0)), nullptr);
  for (uint8_t node : {uint8_t{4}, uint8_t{100}}) {
    const auto record = sut.at(160).find(key(node, 0));
    ASSERT_NE(record, nullptr);
    sut.at(160).open(*record);
  }
  EXPECT_EQ(sut.at(160).insert(key(101, 0), true, true), nullptr);
}

TEST(DuplicateCache, KeepsYoungFloodsFromOneHopMessages) {
  Cache sut;
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    sut.at(100).insert(key(node, 0), true, true);
  }
  EXPECT_EQ(sut.at(110).insert(key(100, 0), false, false), nullptr);
  EXPECT_NE(sut.at(110).insert(key(100, 0), false, true), nullptr);
}

TEST(DuplicateCache, ForgetsANumberThatIsDueAgain) {
  Cache sut;
  sut.at(0).insert(key(1, 3), true, true);
  sut.at(400).insert(key(1, 11), true, true);  // eight numbers on, and long after
  EXPECT_EQ(sut.at(400).find(key(1, 3)), nullptr);
  EXPECT_NE(sut.at(400).find(key(1, 11)), nullptr);
}

TEST(DuplicateCache, SweepsOutOpenMessagesPastTheirTime) {
  Cache sut;
  sut.at(0).open(*sut.at(0).insert(key(1, 1), false, true));
  EXPECT_EQ(sut.at(100).sweep(), nullptr);
  const auto swept = sut.at(101).sweep();
  ASSERT_NE(swept, nullptr);
  EXPECT_EQ(swept->flags & Entry::kGivenUp, Entry::kGivenUp);
}

TEST(DuplicateCache, SeesThatASenderHasGoneOn) {
  Cache sut;
  const auto record = sut.at(0).insert(key(1, 1), false, true);
  sut.at(0).open(*record);
  EXPECT_EQ(record->flags & Entry::kOvertaken, 0);
  sut.at(1).insert(key(1, 2), false, true);
  EXPECT_NE(record->flags & Entry::kOvertaken, 0);
}

}  // namespace
}  // namespace swarmtalk::core
