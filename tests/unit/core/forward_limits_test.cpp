#include "swarmtalk/forward_limits.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::TestNode;
using W = Wire<Wifi>;

/// A message of one packet.
Bytes packet_with_ttl(uint8_t ttl) {
  TestNode<Wifi> sender(1);
  sender.open(5, ttl);
  sender.publisher->send(pattern(9).data(), 9);
  return sender.pull();
}

TEST(ForwardLimits, AsPacketsAreSentOnWithoutOne) {
  TestNode<Wifi> sut(2);
  sut.hear(packet_with_ttl(255));
  EXPECT_EQ(W::decode(sut.pull().data()).ttl, 254);
}

TEST(ForwardLimits, APacketThatAllowsMoreHopsIsSentOnAsIfItAllowedSoMany) {
  TestNode<Wifi> sut(2);
  sut.node.limit_forwarding(16, 1000);
  sut.hear(packet_with_ttl(255));
  EXPECT_EQ(W::decode(sut.pull().data()).ttl, 15);
}

TEST(ForwardLimits, APacketThatAllowsFewerHopsKeepsThem) {
  TestNode<Wifi> sut(2);
  sut.node.limit_forwarding(16, 1000);
  sut.hear(packet_with_ttl(3));
  EXPECT_EQ(W::decode(sut.pull().data()).ttl, 2);
}

TEST(ForwardLimits, ABetterCopyDoesNotRaiseItAboveTheLimit) {
  TestNode<Wifi> sut(2);
  sut.node.limit_forwarding(16, 1000);
  Bytes packet = packet_with_ttl(3);
  sut.hear(packet);
  auto header = W::decode(packet.data());
  header.ttl = 200;
  W::encode(header, packet.data());
  sut.hear(packet);
  EXPECT_EQ(W::decode(sut.pull().data()).ttl, 15);
}

TEST(ForwardLimits, WhatIsToBeDeliveredKeepsItsTtl) {
  TestNode<Wifi> sut(2);
  sut.open(5);
  sut.node.limit_forwarding(16, 1000);
  sut.hear(packet_with_ttl(255));
  ASSERT_EQ(sut.received.size(), 1u);
  EXPECT_EQ(sut.received[0].reception.ttl, 255);
}

TEST(ForwardLimits, NothingIsSentOnWithLimitZeroAndCopiesAreStillKnown) {
  TestNode<Wifi> sut(2);
  sut.open(5);
  sut.node.limit_forwarding(0, 1000);
  const Bytes packet = packet_with_ttl(3);
  sut.hear(packet);
  sut.hear(packet);
  EXPECT_FALSE(sut.node.has_packet());
  EXPECT_EQ(sut.received.size(), 1u);
  EXPECT_EQ(sut.node.counters().duplicates, 1u);
}

TEST(ForwardLimits, WhatHasWaitedForTooLongIsDroppedAndCounted) {
  TestNode<Wifi> sut(2);
  sut.node.limit_forwarding(16, 1000);
  sut.hear(packet_with_ttl(3));
  sut.port.now += 1000;
  sut.node.drop_late_forwards();
  EXPECT_TRUE(sut.node.has_packet());
  sut.port.now += 1;
  EXPECT_TRUE(sut.pull().empty());
  EXPECT_FALSE(sut.node.has_packet());
  EXPECT_EQ(sut.node.next_packet_bytes(), 0);
  EXPECT_EQ(sut.node.forwards_too_late(), 1u);
}

TEST(ForwardLimits, AWaitOfZeroIsNoLimit) {
  TestNode<Wifi> sut(2);
  sut.node.limit_forwarding(16, 0);
  sut.hear(packet_with_ttl(3));
  sut.port.now += 100'000'000;
  EXPECT_FALSE(sut.pull().empty());
  EXPECT_EQ(sut.node.forwards_too_late(), 0u);
}

/// Where few message numbers are, few messages of a sender wait: a new one takes an older one's
/// room.
TEST(ForwardLimits, APacketThatTookAnOlderOnesRoomIsSentOnOnceHoweverOftenItIsHeard) {
  TestNode<Kilobot> sender(1);
  sender.open(1, 3);
  std::vector<Bytes> packets;
  for (int i = 0; i < 8; ++i) {
    ASSERT_EQ(sender.publisher->send(pattern(3).data(), 3), Error::kOk);
    for (const Bytes& packet : sender.pull_all()) packets.push_back(packet);
  }
  TestNode<Kilobot> sut(2);
  for (std::size_t i = 0; i < packets.size(); ++i) sut.hear(packets[i]);
  EXPECT_GT(sut.node.counters().forward_queue_full, 0u);
  sut.hear(packets.back());
  sut.hear(packets.back());
  const std::size_t sent_on = sut.pull_all().size();
  EXPECT_GT(sent_on, 0u);
  EXPECT_EQ(sent_on + sut.node.counters().forward_queue_full, packets.size());
  for (std::size_t i = packets.size() - 2; i < packets.size(); ++i) sut.hear(packets[i]);
  EXPECT_FALSE(sut.node.has_packet());
}

}  // namespace
}  // namespace swarmtalk::core
