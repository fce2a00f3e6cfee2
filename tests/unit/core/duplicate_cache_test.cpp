#include "swarmtalk/duplicate_cache.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

using Cache = DuplicateCache<Kilobot>;
using Moment = Cache::Moment;

Cache::Header header(uint8_t node, uint8_t message, uint8_t channel = 1) {
  Cache::Header result = {};
  result.node = node;
  result.message = message;
  result.channel = channel;
  return result;
}
Moment at(uint16_t ticks) {
  return Moment(ticks);
}

TEST(DuplicateCache, KnowsMessagesByNodeNumberAndChannel) {
  Cache sut;
  const auto record = sut.insert(header(1, 2), true, true, at(0));
  EXPECT_EQ(sut.find(header(1, 2), at(0)), record);
  EXPECT_EQ(sut.find(header(1, 3), at(0)), Cache::kNone);
  EXPECT_EQ(sut.find(header(2, 2), at(0)), Cache::kNone);
  EXPECT_EQ(sut.find(header(1, 2, 3), at(0)), Cache::kNone);
}

TEST(DuplicateCache, ForgetsOneHopMessagesSoonAndFloodsLate) {
  Cache sut;
  sut.insert(header(1, 1), false, true, at(60000));
  sut.insert(header(2, 1), true, true, at(60000));
  EXPECT_NE(sut.find(header(1, 1), at(60008)), Cache::kNone);
  EXPECT_EQ(sut.find(header(1, 1), at(60009)), Cache::kNone);
  const auto across_a_wrap = static_cast<uint16_t>(60000 + 990);
  EXPECT_NE(sut.find(header(2, 1), at(across_a_wrap)), Cache::kNone);
  EXPECT_EQ(sut.find(header(2, 1), at(static_cast<uint16_t>(60000 + 1016))), Cache::kNone);
}

TEST(DuplicateCache, GivesAwayTheOldestClosedRecordAndNeverAnOpenOne) {
  Cache sut;
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    const auto record =
        sut.insert(header(node, 0), true, true, at(static_cast<uint16_t>(node * 8)));
    if (node != 3 && node != 4) sut.open(record, at(150));
  }
  EXPECT_NE(sut.insert(header(100, 0), true, true, at(160)), Cache::kNone);
  EXPECT_EQ(sut.find(header(3, 0), at(160)), Cache::kNone);
  EXPECT_NE(sut.find(header(4, 0), at(160)), Cache::kNone);
  for (uint8_t node : {uint8_t{4}, uint8_t{100}}) {
    const auto record = sut.find(header(node, 0), at(160));
    ASSERT_NE(record, Cache::kNone);
    sut.open(record, at(160));
  }
  EXPECT_EQ(sut.insert(header(101, 0), true, true, at(160)), Cache::kNone);
}

TEST(DuplicateCache, KeepsYoungFloodsFromOneHopMessages) {
  Cache sut;
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    sut.insert(header(node, 0), true, true, at(100));
  }
  EXPECT_EQ(sut.insert(header(100, 0), false, false, at(110)), Cache::kNone);
  EXPECT_NE(sut.insert(header(100, 0), false, true, at(110)), Cache::kNone);
}

TEST(DuplicateCache, ForgetsANumberThatIsDueAgain) {
  Cache sut;
  sut.insert(header(1, 3), true, true, at(0));
  sut.insert(header(1, 11), true, true, at(400));  // eight numbers on, and long after
  EXPECT_EQ(sut.find(header(1, 3), at(400)), Cache::kNone);
  EXPECT_NE(sut.find(header(1, 11), at(400)), Cache::kNone);
}

TEST(DuplicateCache, SweepsOutOpenMessagesPastTheirTime) {
  Cache sut;
  sut.open(sut.insert(header(1, 1), false, true, at(0)), at(0));
  EXPECT_EQ(sut.sweep(at(100)), Cache::kNone);
  const auto swept = sut.sweep(at(101));
  ASSERT_NE(swept, Cache::kNone);
  EXPECT_TRUE(sut.is_given_up(swept));
}

TEST(DuplicateCache, SeesThatASenderHasGoneOn) {
  Cache sut;
  const auto record = sut.insert(header(1, 1), false, true, at(0));
  sut.open(record, at(0));
  EXPECT_EQ(sut.chance(record), Cache::Chance::kWithoutGap);
  sut.insert(header(1, 2), false, true, at(1));
  EXPECT_EQ(sut.chance(record), Cache::Chance::kNone);
}

}  // namespace
}  // namespace swarmtalk::core
