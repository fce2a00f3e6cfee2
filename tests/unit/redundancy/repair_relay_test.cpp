#include "redundancy/repair_relay.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/unit/redundancy/wifi_packets.hpp"

namespace swarmtalk::redundancy {
namespace {

using testing::header_of;
using testing::kFull;
using testing::protected_packets;

class RepairRelayTest : public ::testing::Test {
 protected:
  void offer(std::uint32_t number, std::uint8_t ttl, std::uint64_t now_us, unsigned index = 0) {
    const Bytes packet = protected_packets(header_of(number, 2 * kFull, 7, ttl), 3)[2 + index];
    relay_.offer(packet, Wire::decode(packet.data()), now_us);
  }
  Header take(std::uint64_t now_us) {
    Bytes packet(relay_.packet_bytes());
    relay_.take(packet, now_us);
    return Wire::decode(packet.data());
  }

  RepairRelay relay_;
};

TEST_F(RepairRelayTest, SendsEachParityPacketOnOnce) {
  for (int copies = 0; copies < 3; ++copies) {
    for (const unsigned index : {0u, 1u, 2u}) offer(1, 3, 0, index);
  }
  for (const unsigned index : {0u, 1u, 2u}) {
    const Header header = take(0);
    EXPECT_EQ(header.sequence, 2 + index);
    EXPECT_EQ(header.ttl, 2);
    EXPECT_EQ(header.hops, 1);
  }
  EXPECT_FALSE(relay_.has_packet());
  offer(1, 3, 1'000'000);
  EXPECT_FALSE(relay_.has_packet()) << "also when it comes again later";
  EXPECT_EQ(relay_.forwarded(), 3u);
}

TEST_F(RepairRelayTest, KeepsTheLimitsOfForwarding) {
  offer(1, 0, 0);
  EXPECT_FALSE(relay_.has_packet());
  relay_.limit(16, 1000);
  offer(2, 255, 0);
  EXPECT_EQ(take(0).ttl, 15);
  offer(3, 5, 0);
  relay_.drop_late(1001);
  EXPECT_FALSE(relay_.has_packet());
  EXPECT_EQ(relay_.dropped(), 1u);
  relay_.limit(0, 1000);
  offer(4, 5, 0);
  EXPECT_FALSE(relay_.has_packet());
}

TEST_F(RepairRelayTest, CountsWhatIsBeyondItsRoom) {
  for (std::uint32_t number = 1; number <= RepairRelay::kMostWaiting + 2; ++number) {
    offer(number, 1, 0);
  }
  EXPECT_EQ(relay_.dropped(), 2u);
}

TEST_F(RepairRelayTest, WhatItCannotRememberItDoesNotSendOn) {
  const Bytes packet = protected_packets(header_of(1, 2 * kFull, 7, 1), 1)[2];
  Header header = Wire::decode(packet.data());
  Bytes out(packet.size());
  for (std::uint32_t number = 1; number <= RepairRelay::kMostRemembered; ++number) {
    header.message = number;
    relay_.offer(packet, header, 0);
    relay_.take(out, 0);
  }
  header.message = 1'000'000;
  relay_.offer(packet, header, 0);
  EXPECT_FALSE(relay_.has_packet());
  EXPECT_EQ(relay_.dropped(), 1u);
  relay_.offer(packet, header, RepairRelay::kRememberUs + 1);
  EXPECT_TRUE(relay_.has_packet()) << "there is room when the others are forgotten";
}

}  // namespace
}  // namespace swarmtalk::redundancy
