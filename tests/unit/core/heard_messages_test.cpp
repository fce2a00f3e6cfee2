// What becomes of packets when memory is short. (swarmtalk_test.cpp has the rest of their way.)
#include "swarmtalk/heard_messages.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/support/profiles.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::TestNode;

/// Messages of 8 packets from several senders to a node with 20 slots.
class TightNode {
 public:
  TightNode() { receiver_.open(0); }
  /// Packets first..last of a message, with no time between.
  void hear(uint16_t sender, uint8_t first, uint8_t last) {
    TestNode<testing::RoomFor20> node(sender);
    node.open(0);
    node.publisher->send(pattern(40).data(), 40);
    const auto packets = node.pull_all();
    for (uint8_t i = first; i <= last; ++i) receiver_.hear(packets[i]);
  }
  size_t delivered() const { return receiver_.received.size(); }
  int refused() const { return receiver_.node.counters().no_memory; }

 private:
  TestNode<testing::RoomFor20> receiver_{99};
};

/// The first packet of a message from `sender`, or all of it if it has one.
Bytes packet_of(uint16_t sender, size_t size, uint32_t ttl) {
  TestNode<Kilobot> node(sender);
  node.open(0, ttl);
  node.publisher->send(pattern(size).data(), static_cast<uint16_t>(size));
  return node.pull();
}

TEST(HeardMessages, DeliversAFloodedMessageOnceWhileEveryRecordIsOpen) {
  TestNode<Kilobot> sut(99);
  sut.open(0);
  for (uint16_t sender = 1; sender <= Kilobot::kRecords; ++sender) {
    sut.hear(packet_of(sender, 10, 0));
  }
  ASSERT_EQ(sut.node.counters().no_memory, 0) << "all are being put together";
  const Bytes flooded = packet_of(50, 5, 3);
  for (int copy = 0; copy < 3; ++copy) sut.hear(flooded);
  EXPECT_EQ(sut.received.size(), 1u);
  EXPECT_EQ(sut.node.counters().duplicates, 2);
  EXPECT_EQ(sut.node.counters().no_memory, 1) << "one that was begun made place";
  EXPECT_EQ(sut.pull_all().size(), 1u) << "and it is sent on, once";
}

TEST(HeardMessages, DeliversAOneHopMessageWithoutARecordWhileEveryRecordIsOpen) {
  TestNode<Kilobot> sut(99);
  sut.open(0);
  for (uint16_t sender = 1; sender <= Kilobot::kRecords; ++sender) {
    sut.hear(packet_of(sender, 10, 0));
  }
  sut.hear(packet_of(50, 5, 0));
  EXPECT_EQ(sut.received.size(), 1u);
  EXPECT_EQ(sut.node.counters().no_memory, 0) << "nothing had to make place";
}

/// The bound of docs/decisions/0033: copies are known of as many flooded messages as there are
/// records that are not open, and of no more at a time: the next ones are not taken up.
TEST(HeardMessages, TakesUpAsManyFloodsAsItCanTellCopiesOf) {
  for (uint16_t open : {uint16_t{0}, uint16_t{5}, uint16_t{19}}) {
    const uint16_t closed = static_cast<uint16_t>(Kilobot::kRecords - open);
    TestNode<Kilobot> sut(99);
    sut.open(0);
    for (uint16_t sender = 1; sender <= open; ++sender) sut.hear(packet_of(sender, 10, 3));
    for (uint16_t other = 0; other < closed; ++other) {
      sut.hear(packet_of(static_cast<uint16_t>(100 + other), 5, 3));
    }
    EXPECT_EQ(sut.received.size(), closed);
    for (uint16_t other = 0; other < closed; ++other) {
      sut.hear(packet_of(static_cast<uint16_t>(100 + other), 5, 3));
    }
    EXPECT_EQ(sut.received.size(), closed) << "copies";
    const auto refused = sut.node.counters().no_memory;
    sut.hear(packet_of(200, 5, 3));
    const bool one_open_made_place = open != 0;
    EXPECT_EQ(sut.received.size(), closed + (one_open_made_place ? 1u : 0u)) << open;
    EXPECT_EQ(sut.node.counters().no_memory, refused + 1);
    sut.port.now += 1000;  // copies do not wander any more
    sut.hear(packet_of(201, 5, 3));
    EXPECT_EQ(sut.received.size(), closed + (one_open_made_place ? 2u : 1u)) << open;
  }
}

TEST(HeardMessages, BeginsWhateverFitsWhileLengthsAreUnknown) {
  TightNode sut;
  for (uint16_t sender = 1; sender <= 4; ++sender) sut.hear(sender, 0, 0);
  EXPECT_EQ(sut.refused(), 0);
}

TEST(HeardMessages, BeginsNoThirdMessageThatWouldNotFitBesideTwoThatJustBegan) {
  TightNode sut;
  sut.hear(50, 0, 7);
  ASSERT_EQ(sut.delivered(), 1u);
  for (uint16_t sender = 1; sender <= 3; ++sender) sut.hear(sender, 0, 0);
  EXPECT_EQ(sut.refused(), 1) << "3 times 7 packets are 21";
  sut.hear(1, 1, 7);
  sut.hear(2, 1, 7);
  sut.hear(3, 1, 7);
  EXPECT_EQ(sut.delivered(), 3u);
}

TEST(HeardMessages, BeginsAThirdMessageThatWillFitWhenTheFirstEnds) {
  TightNode sut;
  sut.hear(50, 0, 7);
  sut.hear(1, 0, 1);
  sut.hear(2, 0, 0);
  sut.hear(3, 0, 0);  // 7 + 6 + 6 when the first has 7
  EXPECT_EQ(sut.refused(), 0);
  for (uint8_t i = 1; i < 8; ++i) {
    if (i < 7) sut.hear(1, static_cast<uint8_t>(i + 1), static_cast<uint8_t>(i + 1));
    sut.hear(2, i, i);
    sut.hear(3, i, i);
  }
  EXPECT_EQ(sut.delivered(), 4u);
}

/// More records than 8 bits count, and room for 260 messages of three packets that all hold one.
struct ManyRecords : Kilobot {
  static constexpr uint8_t kNodeBits = 16;
  static constexpr uint16_t kRecords = 400;
  static constexpr uint16_t kFragmentSlots = 520;
  static constexpr uint16_t kMtuBytes = 10;
  static constexpr uint32_t kBufferBudgetBytes = 32768;
};
TEST(HeardMessages, ForecastsWithMoreMessagesThanEightBitsCount) {
  TestNode<ManyRecords> sut(999);
  sut.open(0);
  for (uint16_t sender = 1; sender <= 400; ++sender) {
    TestNode<ManyRecords> node(sender);
    node.open(0);
    node.publisher->send(pattern(15).data(), 15);
    const auto packets = node.pull_all();
    ASSERT_EQ(packets.size(), 3u);
    for (size_t i = 0; i < (sender == 1 ? 3u : 1u); ++i) sut.hear(packets[i]);
    // The first one is whole and tells what is usual. Of n others each holds 1 and will hold 2.
    ASSERT_EQ(sut.node.counters().no_memory, sender <= 261 ? 0 : sender - 261) << sender;
  }
}

TEST(HeardMessages, MakesNoForecastWhilePacketsAreLost) {
  TightNode sut;
  sut.hear(50, 0, 7);
  sut.hear(1, 0, 0);
  sut.hear(2, 0, 0);
  sut.hear(2, 2, 2);  // one is missing
  sut.hear(3, 0, 0);
  sut.hear(4, 0, 0);
  EXPECT_EQ(sut.refused(), 0);
}

}  // namespace
}  // namespace swarmtalk::core
