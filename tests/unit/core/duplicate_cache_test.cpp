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

constexpr uint8_t kOneHop = 0;
constexpr uint8_t kFlood = Entry::kFlood;
constexpr uint8_t kDirect = Entry::kFlood | Entry::kDirect;
constexpr uint8_t kRelayed = Entry::kFlood | Entry::kRelayed;
constexpr uint8_t kAll = 0xFF;

/// The cache, with the time as an argument of each call.
struct Cache : DuplicateCache<Kilobot> {
  Cache& at(uint32_t ticks) {
    set_now(ticks);
    return *this;
  }
  Entry* insert(const Key& key, uint8_t kind, bool insist = true) {
    return begin_record(find(key), key, kind, insist, *this);
  }
  /// What the node does for the cache.
  void open(Entry& record) {
    record.flags = static_cast<uint8_t>((record.flags & ~Entry::kDone) | Entry::kOpen);
    renew_stamp(record);
  }
  void expire(Entry& passed) {
    close(passed, kAll);
    ++given_up;
  }
  uint8_t worth(const Entry& record) const { return static_cast<uint8_t>(record.held + 1); }
  void look_ahead(const OpenMessages<Kilobot>& messages) { open_messages = messages; }
  /// What a packet with this key is taken for. @param packet  of its message, from 0
  bool is_copy(const Key& key, bool direct, uint8_t packet = 0) {
    const Entry* const record = find(key);
    return record != nullptr && !is_of_later(*record, direct, static_cast<uint8_t>(1 << packet));
  }
  int given_up = 0;
  OpenMessages<Kilobot> open_messages;  // as the last message began
};

TEST(DuplicateCache, KnowsMessagesByNodeNumberAndChannel) {
  Cache sut;
  const auto record = sut.at(0).insert(key(1, 2), kFlood);
  EXPECT_EQ(sut.at(0).find(key(1, 2)), record);
  EXPECT_EQ(sut.at(0).find(key(1, 3)), nullptr);
  EXPECT_EQ(sut.at(0).find(key(2, 2)), nullptr);
  EXPECT_EQ(sut.at(0).find(key(1, 2, 3)), nullptr);
}

TEST(DuplicateCache, ForgetsOneHopMessagesSoonAndFloodsLate) {
  Cache sut;
  sut.at(60000).insert(key(1, 1), kOneHop)->flags = Entry::kDone;
  sut.at(60000).insert(key(2, 1), kFlood);
  EXPECT_TRUE(sut.at(60008).is_copy(key(1, 1), true));
  EXPECT_FALSE(sut.at(60009).is_copy(key(1, 1), true));
  EXPECT_TRUE(sut.at(60000 + 2000).is_copy(key(2, 1), false));  // across a wrap of 16 bits
  EXPECT_FALSE(sut.at(60000 + 2001).is_copy(key(2, 1), false));
}

TEST(DuplicateCache, KnowsWhenAPauseHasOutlastedEverything) {
  Cache sut;
  sut.at(5).insert(key(1, 1), kFlood);
  EXPECT_FALSE(sut.has_ended(5 + 2000));
  for (uint32_t pause : {2001u, 65536u, 65600u, 1000000u, 0xFFFFFFFFu}) {
    EXPECT_TRUE(sut.has_ended(5 + pause)) << pause;
  }
  EXPECT_TRUE(sut.is_copy(key(1, 1), false));
  sut.forget_all();
  EXPECT_FALSE(sut.is_copy(key(1, 1), false));
}

TEST(DuplicateCache, TakesAPacketFromItsSenderForANewMessageWhenALinkWouldNotRepeatIt) {
  Cache sut;
  sut.close(*sut.at(100).insert(key(1, 1), kDirect), kAll);
  EXPECT_TRUE(sut.at(108).is_copy(key(1, 1), true));
  EXPECT_FALSE(sut.at(109).is_copy(key(1, 1), true));
  EXPECT_TRUE(sut.at(109).is_copy(key(1, 1), false));  // a forwarder's is late
}

TEST(DuplicateCache, TakesAPacketFromItsSenderForANewMessageIfOnlyForwardersWereHeard) {
  Cache sut;
  sut.close(*sut.at(100).insert(key(1, 1), kRelayed), kAll);
  EXPECT_FALSE(sut.at(101).is_copy(key(1, 1), true));
  EXPECT_TRUE(sut.at(101).is_copy(key(1, 1), false));
  sut.close(*sut.at(100).insert(key(2, 1), kFlood), kAll);  // nobody knows who sent it
  EXPECT_TRUE(sut.at(101).is_copy(key(2, 1), true));
}

TEST(DuplicateCache, KnowsTheRestOfAMessageThatWasGivenUp) {
  Cache sut;
  sut.close(*sut.at(100).insert(key(1, 1), kDirect), 1);
  EXPECT_TRUE(sut.at(150).is_copy(key(1, 1), true, 1));
  EXPECT_FALSE(sut.at(150).is_copy(key(1, 1), true, 0));
}

TEST(DuplicateCache, EndsAnOpenMessageWhenItsSenderIsHeardBeginningAnother) {
  Cache sut;
  sut.open(*sut.at(100).insert(key(1, 1), kDirect));
  EXPECT_TRUE(sut.at(300).is_copy(key(1, 1), true, 1));
  EXPECT_FALSE(sut.at(325).is_copy(key(1, 1), true, 1)) << "long after";
  sut.at(300);
  sut.insert(key(1, 2), kDirect);
  EXPECT_FALSE(sut.is_copy(key(1, 1), true, 1));
  EXPECT_TRUE(sut.is_copy(key(1, 1), false, 1));  // forwarders bring what was lost
}

TEST(DuplicateCache, ForgetsANumberAfterHalfOfTheOthers) {
  Cache sut;
  sut.at(0).insert(key(1, 3), kRelayed);
  for (uint8_t number = 4; number <= 10; ++number) sut.insert(key(1, number), kRelayed);
  EXPECT_TRUE(sut.is_copy(key(1, 3), false));
  sut.insert(key(2, 11), kRelayed);     // another sender's
  sut.insert(key(1, 11, 2), kRelayed);  // another channel's
  EXPECT_TRUE(sut.is_copy(key(1, 3), false));
  sut.insert(key(1, 11), kRelayed);
  EXPECT_FALSE(sut.is_copy(key(1, 3), false));
  EXPECT_TRUE(sut.is_copy(key(1, 4), false));
}

TEST(DuplicateCache, GivesUpAnOpenMessageThatItsSenderHasPassed) {
  Cache sut;
  sut.open(*sut.at(0).insert(key(1, 0), kRelayed));
  for (uint8_t number = 1; number <= 7; ++number) sut.insert(key(1, number), kRelayed);
  EXPECT_EQ(sut.given_up, 0);
  sut.insert(key(1, 8), kRelayed);
  EXPECT_EQ(sut.given_up, 1);
  EXPECT_FALSE(sut.is_copy(key(1, 0), false));
}

TEST(DuplicateCache, KeepsWhatWasHeardFromItsSenderItselfAgainstLateCopies) {
  Cache sut;
  for (uint8_t number = 0; number < 16; ++number) {
    sut.close(*sut.at(number * 2).insert(key(1, number), kDirect), kAll);
  }
  for (uint8_t number = 0; number < 16; ++number) {
    EXPECT_TRUE(sut.at(32).is_copy(key(1, number), false)) << int{number};
  }
  EXPECT_FALSE(sut.at(32).is_copy(key(1, 0), true));
}

TEST(DuplicateCache, GivesAwayTheOldestClosedRecordAndNeverAnOpenOne) {
  Cache sut;
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    sut.at(node * 8u).insert(key(node, 0), kFlood);
  }
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    if (node != 3 && node != 4) sut.at(152).open(*sut.find(key(node, 0)));
  }
  EXPECT_NE(sut.at(160).insert(key(100, 0), kFlood), nullptr);
  EXPECT_EQ(sut.at(160).find(key(3, 0)), nullptr);
  EXPECT_NE(sut.at(160).find(key(4, 0)), nullptr);
  for (uint8_t node : {uint8_t{4}, uint8_t{100}}) {
    const auto record = sut.at(160).find(key(node, 0));
    ASSERT_NE(record, nullptr);
    sut.at(160).open(*record);
  }
  EXPECT_EQ(sut.at(160).insert(key(101, 0), kFlood), nullptr);
}

TEST(DuplicateCache, KeepsFloodsWhoseCopiesWanderFromAllThatDoNotInsist) {
  Cache sut;
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    sut.at(100).insert(key(node, 0), kFlood);
  }
  EXPECT_EQ(sut.at(100 + 224).insert(key(100, 0), kOneHop, false), nullptr);
  EXPECT_EQ(sut.at(100 + 224).insert(key(100, 0), kFlood, false), nullptr);
  EXPECT_NE(sut.at(100 + 224).insert(key(100, 0), kOneHop, true), nullptr);
  EXPECT_NE(sut.at(100 + 225).insert(key(101, 0), kFlood, false), nullptr);
}

TEST(DuplicateCache, KeepsFloodsForLongerTheMorePacketsWait) {
  Cache sut;
  for (uint8_t node = 0; node < Kilobot::kRecords; ++node) {
    sut.at(100).insert(key(node, 0), kFlood);
  }
  sut.set_waiting(10);  // about an eighth more for each
  EXPECT_EQ(sut.at(100 + 224 + 240).insert(key(100, 0), kFlood, false), nullptr);
  EXPECT_NE(sut.at(100 + 224 + 241).insert(key(100, 0), kFlood, false), nullptr);
}

TEST(DuplicateCache, KeepsAFloodForLongerWhileCopiesOfItAreHeard) {
  Cache sut;
  sut.at(100).insert(key(1, 0), kRelayed);
  sut.hear_copy(*sut.at(2000).find(key(1, 0)));
  EXPECT_TRUE(sut.at(4000).is_copy(key(1, 0), false));
  sut.insert(key(1, 1), kRelayed);  // its sender goes on
  sut.hear_copy(*sut.find(key(1, 0)));
  EXPECT_FALSE(sut.at(4001).is_copy(key(1, 0), false));
}

TEST(DuplicateCache, ReusesAnOpenRecordPastItsTime) {
  Cache sut;
  sut.at(0).open(*sut.insert(key(1, 1), kOneHop));
  EXPECT_TRUE(sut.at(100).is_copy(key(1, 1), true, 1));
  EXPECT_FALSE(sut.at(105).is_copy(key(1, 1), true, 1));  // ages are counted in steps of 8 ticks
  sut.insert(key(2, 1), kOneHop);
  EXPECT_EQ(sut.given_up, 1);
}

TEST(DuplicateCache, TellsOfTheOpenMessagesAsAnotherOneBegins) {
  Cache sut;
  sut.at(0).insert(key(9, 1), kFlood);
  for (uint8_t node : {uint8_t{2}, uint8_t{3}, uint8_t{4}}) {
    const auto record = sut.insert(key(node, 1), kOneHop);
    sut.open(*record);
    record->held = static_cast<uint8_t>(node == 3 ? 1 : 4);
  }
  EXPECT_EQ(sut.open_messages.messages, 3) << "two, and the one that begins";
  sut.insert(key(5, 1), kOneHop);
  EXPECT_EQ(sut.open_messages.messages, 4);
  EXPECT_EQ(sut.open_messages.held, 1 + 4 + 1 + 4);
  EXPECT_EQ(sut.open_messages.most, 5);
  EXPECT_EQ(sut.open_messages.least, sut.find(key(3, 1)));
  EXPECT_EQ(sut.open_messages.worth, 2);
  sut.look_at_others(*sut.find(key(3, 1)), sut);
  EXPECT_EQ(sut.open_messages.messages, 3);
  EXPECT_EQ(sut.open_messages.worth, 5);
  EXPECT_TRUE(sut.find(key(3, 1))->is_open());
}

TEST(DuplicateCache, SeesThatASenderHasGoneOn) {
  Cache sut;
  const auto record = sut.at(0).insert(key(1, 1), kOneHop);
  sut.at(0).open(*record);
  EXPECT_FALSE(record->is_overtaken());
  sut.at(1).insert(key(1, 2), kOneHop);
  EXPECT_TRUE(record->is_overtaken());
}

}  // namespace
}  // namespace swarmtalk::core
