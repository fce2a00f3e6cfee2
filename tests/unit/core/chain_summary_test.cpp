#include "swarmtalk/chain_summary.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/record_index.hpp"

namespace swarmtalk::core {
namespace {

using Summary = ChainSummary<Footbot, true>;
using Key = RecordKey<Footbot>;

Key key(uint32_t number, uint32_t node = 7, uint32_t channel = 3) {
  Wire<Footbot>::Header header = {};
  header.node = static_cast<uint8_t>(node);
  header.message = static_cast<uint8_t>(number);
  header.channel = static_cast<uint8_t>(channel);
  uint8_t packet[Wire<Footbot>::kHeaderBytes];
  Wire<Footbot>::encode(header, packet);
  return Key(packet);
}

/// A chain of messages 0, 1, 2, ... of one sender and channel, at places 1, 2, 3, ...
struct Chain {
  explicit Chain(uint16_t messages) {
    for (uint16_t number = 0; number < messages; ++number) {
      Record<Footbot>& record = records[number];
      record = {};
      record.key = key(number);
      record.flags = Record<Footbot>::kFlood;
      if (number == 1) {
        records[0].set_later(1);  // as the node does, before the second one's record is linked
        summary.begin(records[0], 1);
      }
      if (number == 0) continue;
      summary.put(record.key, static_cast<uint16_t>(number + 1));
      summary.count_begun(record, record.key);
    }
  }
  Record<Footbot> records[16];
  Summary summary;
};

TEST(ChainSummary, IsOfOneSenderAndChannelUntilItEnds) {
  Chain chain(2);
  EXPECT_TRUE(chain.summary.is_kept());
  EXPECT_TRUE(chain.summary.is_of(key(0)));
  EXPECT_TRUE(chain.summary.is_of(key(15)));
  EXPECT_FALSE(chain.summary.is_of(key(0, 8)));
  EXPECT_FALSE(chain.summary.is_of(key(0, 7, 4)));
  chain.summary.end();
  EXPECT_FALSE(chain.summary.is_kept());
  for (uint32_t node = 0; node < 256; ++node) EXPECT_FALSE(chain.summary.is_of(key(15, node, 15)));
}

TEST(ChainSummary, TellsThePlaceOfEachNumber) {
  Chain chain(5);
  for (uint32_t number = 0; number < 16; ++number) {
    EXPECT_EQ(chain.summary.place_of(key(number)), number < 5 ? number + 1 : 0) << number;
  }
  chain.summary.move(key(1), key(9), 2);
  EXPECT_EQ(chain.summary.place_of(key(1)), 0);
  EXPECT_EQ(chain.summary.place_of(key(9)), 2);
  chain.summary.remove(key(4));
  EXPECT_EQ(chain.summary.place_of(key(4)), 0);
  EXPECT_EQ(chain.summary.last(), 0);
}

TEST(ChainSummary, CountsHowManyBeganAfterEach) {
  Chain chain(12);
  for (uint8_t number = 0; number < 12; ++number) {
    EXPECT_EQ(chain.summary.later_than(chain.records[number]), 11 - number);
  }
  EXPECT_EQ(chain.summary.last(), 12);
  EXPECT_EQ(chain.summary.eighth(), 5);  // number 4: the eighth before number 12
  EXPECT_TRUE(chain.summary.is_eighth(chain.records[4]));
  EXPECT_FALSE(chain.summary.is_eighth(chain.records[5]));
}

TEST(ChainSummary, FindsTheOldestOfTheLastEightThatHasARecord) {
  Chain chain(12);
  EXPECT_EQ(chain.summary.oldest(), 5);
  chain.summary.remove(key(4));
  chain.summary.remove(key(5));
  EXPECT_EQ(chain.summary.eighth(), 0);
  EXPECT_EQ(chain.summary.oldest(), 7);
}

/// What a record has counted before counts on, and what was counted here is told to a record that
/// is left alone.
TEST(ChainSummary, TakesOverAndHandsBackCounts) {
  Chain chain(1);
  chain.records[0].set_later(3);
  chain.summary.begin(chain.records[0], 1);
  Record<Footbot>& next = chain.records[1];
  next = {};
  next.key = key(1);
  next.flags = Record<Footbot>::kFlood;
  chain.summary.put(next.key, 2);
  chain.summary.count_begun(next, next.key);
  EXPECT_EQ(chain.summary.later_than(chain.records[0]), 3);  // told of the second one already
  chain.summary.count_begun(next, next.key);
  chain.summary.count_out(chain.records[0]);
  EXPECT_EQ(chain.records[0].later(), 4);
}

}  // namespace
}  // namespace swarmtalk::core
