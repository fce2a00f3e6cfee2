#include "swarmtalk/forward_queue.hpp"

#include <gtest/gtest.h>
#include <string.h>

#include <utility>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

using W = Wire<Kilobot>;
using Pushed = ForwardQueue<Kilobot>::Pushed;

struct Packet {
  uint8_t bytes[9] = {};
  W::Header header;
  Packet(uint8_t node, uint8_t ttl, uint8_t message = 0) {
    header = {};
    header.node = node;
    header.message = message;
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
  ASSERT_EQ(sut.push(packet.bytes, 9, packet.header, 65530), Pushed::kDone);
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
    ASSERT_EQ(sut.push(packet.bytes, 9, packet.header, 0), Pushed::kDone);
  }
  const Packet full(11, 3);
  EXPECT_EQ(sut.push(full.bytes, 9, full.header, 0), Pushed::kFull);
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

TEST(ForwardQueue, LetsThreeMessagesOfASenderWaitTheNewest) {
  ForwardQueue<Kilobot> sut;
  for (uint8_t message = 14; message <= 17; ++message) {
    const Packet other(9, 3, message);
    const Packet packet(1, 3, message);
    const bool has_room = message <= 16;
    EXPECT_EQ(sut.push(packet.bytes, 9, packet.header, 0),
              has_room ? Pushed::kDone : Pushed::kForAnother);
    if (message == 15) {
      EXPECT_EQ(sut.push(other.bytes, 9, other.header, 0), Pushed::kDone);
    }
  }
  const std::pair<uint8_t, uint8_t> expected[] = {{1, 15}, {9, 15}, {1, 0}, {1, 1}};
  for (const auto& [node, message] : expected) {
    uint8_t out[9];
    ASSERT_FALSE(sut.is_empty());
    sut.pull(false, 0, out);
    EXPECT_EQ(W::decode(out).node, node);
    EXPECT_EQ(W::decode(out).message, message);
  }
  EXPECT_TRUE(sut.is_empty());
}

TEST(ForwardQueue, LetsAllPacketsOfAMessageWait) {
  ForwardQueue<Kilobot> sut;
  const Packet packet(1, 3);
  for (int sequence = 0; sequence < 8; ++sequence) {
    EXPECT_EQ(sut.push(packet.bytes, 9, packet.header, 0), Pushed::kDone);
  }
  EXPECT_EQ(sut.size(), 8);
}

struct Repeating : Kilobot {
  static constexpr uint8_t kForwardRepeats = 1;
};
TEST(ForwardQueue, RepeatsWhereTheProfileAsksForIt) {
  ForwardQueue<Repeating> sut;
  memset(static_cast<void*>(&sut), 0, sizeof(sut));  // as a node does on AVR
  sut.start();
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
