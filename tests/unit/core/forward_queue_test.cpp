#include "swarmtalk/forward_queue.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

using W = Wire<Kilobot>;

struct Packet {
  uint8_t bytes[9] = {};
  W::Header header;
  Packet(uint8_t node, uint8_t ttl) {
    header = {};
    header.node = node;
    header.end = true;
    header.channel = 9;
    header.ttl = ttl;
    W::encode(header, bytes);
    W::seal(bytes, 8);
  }
};

TEST(ForwardQueue, SendsOnWithOneTtlLessAndTheWaitAdded) {
  ForwardQueue<Kilobot> sut;
  const Packet packet(1, 3);
  ASSERT_TRUE(sut.push(packet.bytes, 9, packet.header, 65530));
  uint8_t out[9];
  ASSERT_EQ(sut.pull(true, 14, out), 9);
  EXPECT_EQ(W::check(out, 9), Error::kOk);
  EXPECT_EQ(W::decode(out).ttl, 2);
  EXPECT_EQ(W::timestamp(out, 8), 20);
  EXPECT_TRUE(sut.is_empty());
}

TEST(ForwardQueue, RaisesTheTtlOfAWaitingCopyAndNeverLowersIt) {
  ForwardQueue<Kilobot> sut;
  for (uint8_t node = 1; node <= 10; ++node) {
    const Packet packet(node, 3);
    ASSERT_TRUE(sut.push(packet.bytes, 9, packet.header, 0));
  }
  const Packet full(11, 3);
  EXPECT_FALSE(sut.push(full.bytes, 9, full.header, 0));
  const Packet better(2, 7);
  sut.improve(better.bytes, better.header);
  const Packet worse(3, 1);
  sut.improve(worse.bytes, worse.header);
  uint8_t out[9];
  const uint8_t expected[] = {2, 6, 2};
  for (uint8_t ttl : expected) {
    sut.pull(false, 0, out);
    EXPECT_EQ(W::decode(out).ttl, ttl);
  }
}

struct Repeating : Kilobot {
  static constexpr uint8_t kForwardRepeats = 1;
};
TEST(ForwardQueue, RepeatsWhereTheProfileAsksForIt) {
  ForwardQueue<Repeating> sut;
  for (uint8_t node = 1; node <= 2; ++node) {
    const Packet packet(node, 3);
    sut.push(packet.bytes, 9, Wire<Repeating>::decode(packet.bytes), 0);
  }
  uint8_t out[9];
  const uint8_t expected[] = {1, 1, 2, 2};
  for (uint8_t node : expected) {
    sut.pull(false, 0, out);
    EXPECT_EQ(Wire<Repeating>::decode(out).node, node);
  }
  EXPECT_TRUE(sut.is_empty());
}

}  // namespace
}  // namespace swarmtalk::core
