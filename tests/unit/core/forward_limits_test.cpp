#include "swarmtalk/forward_limits.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace swarmtalk::core
