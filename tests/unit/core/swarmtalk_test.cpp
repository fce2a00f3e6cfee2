#include "swarmtalk/swarmtalk.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::TestNode;

template <class P>
std::unique_ptr<TestNode<P>> make(uint16_t id) {
  return std::make_unique<TestNode<P>>(id);
}

TEST(SwarmtalkWifi, CarriesEverySizeByteForByte) {
  auto a = make<Wifi>(1);
  auto b = make<Wifi>(2);
  a->open(500);
  b->open(500);
  for (size_t size = 0; size <= 16384; size += (size < 1400 ? 1 : 97)) {
    b->received.clear();
    const Bytes message = pattern(size);
    ASSERT_EQ(a->publisher->send(message.data(), static_cast<uint16_t>(size)), Error::kOk);
    for (const Bytes& packet : a->pull_all()) ASSERT_EQ(b->hear(packet), Error::kOk);
    ASSERT_EQ(b->received.size(), 1u) << size;
    ASSERT_EQ(b->received[0].bytes, message);
  }
  EXPECT_EQ(a->publisher->send(pattern(16385).data(), 16385), Error::kTooLong);
}

TEST(SwarmtalkWifi, NumbersMessagesFromOneAndTellsTheirOrigin) {
  auto a = make<Wifi>(1);
  auto b = make<Wifi>(2);
  a->node.set_epoch(0xBEEF);
  a->open(500);
  b->open(500);
  for (uint32_t number = 1; number <= 3; ++number) {
    a->publisher->send(pattern(4).data(), 4);
    b->hear(a->pull());
    EXPECT_EQ(b->received.back().reception.message, number);
  }
  EXPECT_EQ(b->received[0].reception.node, 1);
  EXPECT_EQ(b->received[0].reception.epoch, 0xBEEF);
  EXPECT_EQ(b->received[0].reception.channel, 500);
  EXPECT_EQ(b->received[0].reception.hops, 0);
  EXPECT_FALSE(b->received[0].reception.has_delay);
}

TEST(SwarmtalkWifi, GoesOnNumberingWhenAChannelIsOpenedAgain) {
  auto a = make<Wifi>(1);
  auto b = make<Wifi>(2);
  b->open(500);
  for (uint32_t number = 1; number <= 3; ++number) {
    auto* channel = a->open(500);
    a->publisher->send(pattern(4).data(), 4);
    b->hear(a->pull());
    a->node.remove_channel(channel);
  }
  EXPECT_EQ(b->received.size(), 3u);
  EXPECT_EQ(b->received.back().reception.message, 3u);
}

TEST(SwarmtalkKilobot, GoesOnNumberingWhereItStartedAtRandomWhenAChannelIsOpenedAgain) {
  TestNode<Kilobot> a;
  a.port.next_random = UINT32_C(0xE0000) + 1;  // its id is 1, and 14 is added to its first number
  TestNode<Kilobot> b(2);
  b.open(3);
  for (int i = 0; i < 3; ++i) {
    auto* channel = a.open(3);
    a.publisher->send(pattern(4).data(), 4);
    b.hear(a.pull());
    a.node.remove_channel(channel);
  }
  ASSERT_EQ(b.received.size(), 3u);
  EXPECT_EQ(b.received[0].reception.message, 15);
  EXPECT_EQ(b.received[1].reception.message, 0);
  EXPECT_EQ(b.received[2].reception.message, 1);
}

TEST(SwarmtalkKilobot, KnowsItsOwnMessagesWhenTheirChannelIsOpenedAgain) {
  TestNode<Kilobot> a;
  auto* channel = a.open(3, 3);
  a.publisher->send(pattern(4).data(), 4);
  TestNode<Kilobot> b(2);
  b.hear(a.pull());
  a.node.remove_channel(channel);
  a.open(3, 3);
  const auto id = a.node.node_id();
  a.hear(b.pull());
  EXPECT_EQ(a.node.node_id(), id);
  EXPECT_EQ(a.node.counters().own_echoes, 1);
}

TEST(SwarmtalkWifi, ReusesChannelsThatWereRemoved) {
  auto a = make<Wifi>(1);
  for (uint32_t id = 0; id < 1000; ++id) {
    auto* channel = a->open(id);
    ASSERT_NE(channel, nullptr);
    a->node.remove_channel(channel);
  }
  for (uint32_t id = 0; id < Wifi::kChannels; ++id) ASSERT_NE(a->open(id), nullptr);
  EXPECT_EQ(a->open(999), nullptr);
  EXPECT_EQ(a->node.last_error(), Error::kNoRoom);
}

TEST(SwarmtalkWifi, ForwardsWithOneHopMoreAndTellsTheReceiver) {
  auto a = make<Wifi>(1);
  auto b = make<Wifi>(2);
  auto c = make<Wifi>(3);
  a->open(500, 4, true);
  c->open(500, 4, true);
  a->publisher->send(pattern(3000).data(), 3000);
  a->port.now = 100;
  for (const Bytes& packet : a->pull_all()) b->hear(packet);
  b->port.now = 1000;  // waits 1000 us in b's queue
  for (const Bytes& packet : b->pull_all()) c->hear(packet);
  ASSERT_EQ(c->received.size(), 1u);
  EXPECT_EQ(c->received[0].bytes, pattern(3000));
  EXPECT_EQ(c->received[0].reception.hops, 1);
  EXPECT_EQ(c->received[0].reception.ttl, 3);
  EXPECT_TRUE(c->received[0].reception.has_delay);
  EXPECT_EQ(c->received[0].reception.delay_ticks, 1100u);
}

TEST(SwarmtalkWifi, CountsTheDelayFromWhenTheMessageWasHandedOver) {
  auto a = make<Wifi>(1);
  auto b = make<Wifi>(2);
  Channel<Wifi>* const channel = a->open(500, 0, true);
  b->open(500, 0, true);
  a->port.now = 5000;
  for (const uint32_t waited : {0u, 700u, 6000u}) {  // the last from before the clock began
    b->received.clear();
    ASSERT_EQ(channel->publish(pattern(10).data(), 10, 0, false, waited), Error::kOk);
    EXPECT_EQ(channel->publish(pattern(10).data(), 10, 0, false, 1), Error::kBusy);
    a->port.now += 30;
    for (const Bytes& packet : a->pull_all()) b->hear(packet);
    ASSERT_EQ(b->received.size(), 1u);
    EXPECT_EQ(b->received[0].reception.delay_ticks, waited + 30);
  }
}

TEST(SwarmtalkWifi, TakesATtlAndAGatewayMarkPerMessage) {
  auto a = make<Wifi>(1);
  auto b = make<Wifi>(2);
  a->open(500, 0);
  b->open(500, 0);
  EXPECT_EQ(a->publisher->send(pattern(3).data(), 3, 255, true), Error::kOk);
  b->hear(a->pull());
  EXPECT_TRUE(b->received.at(0).reception.crossed_gateway);
  EXPECT_EQ(b->received.at(0).reception.ttl, 255);
}

TEST(SwarmtalkWifi, LetsAnUnknownDistancePass) {
  auto a = make<Wifi>(1);
  auto b = make<Wifi>(2);
  a->open(500);
  b->open(500);
  for (float distance_m : {NAN, 99.0f, 100.0f}) {
    a->publisher->send(pattern(3).data(), 3);
    b->hear(a->pull(), PoseSensing{distance_m, NAN, 0});
  }
  EXPECT_EQ(b->received.size(), 2u);
  EXPECT_EQ(b->node.counters().too_far, 1u);
}

TEST(SwarmtalkKilobot, CarriesEverySizePaddedToWholePackets) {
  auto a = make<Kilobot>(1);
  auto b = make<Kilobot>(2);
  a->open(0);
  b->open(0);
  for (uint16_t size = 1; size <= 40; ++size) {
    b->received.clear();
    a->port.now = b->port.now += 100;
    const Bytes message = pattern(size);
    ASSERT_EQ(a->publisher->send(message.data(), size), Error::kOk);
    for (const Bytes& packet : a->pull_all()) {
      ASSERT_EQ(packet.size(), 9u);
      ASSERT_EQ(b->hear(packet), Error::kOk);
    }
    ASSERT_EQ(b->received.size(), 1u) << size;
    Bytes padded = message;
    padded.resize(static_cast<size_t>((size + 4) / 5 * 5));
    ASSERT_EQ(b->received[0].bytes, padded);
  }
  EXPECT_EQ(a->publisher->send(pattern(41).data(), 41), Error::kTooLong);
  EXPECT_EQ(a->publisher->send(nullptr, 0), Error::kEmpty);
}

TEST(Swarmtalk, AnswersBusyUntilTheLastPacketIsPulledAndThenCallsSent) {
  auto a = make<Kilobot>(1);
  a->open(0);
  EXPECT_EQ(a->publisher->send(pattern(10).data(), 10), Error::kOk);
  EXPECT_EQ(a->publisher->send(pattern(10).data(), 10), Error::kBusy);
  EXPECT_FALSE(a->publisher->available());
  a->pull();
  EXPECT_EQ(a->sent, 0);
  a->pull();
  EXPECT_EQ(a->sent, 1);
  EXPECT_TRUE(a->publisher->available());
}

struct Resender {
  Publisher<Kilobot>* publisher = nullptr;
  int sent = 0;
  static void on_sent(void* self) {
    auto* resender = static_cast<Resender*>(self);
    ++resender->sent;
    const uint8_t byte = 1;
    EXPECT_EQ(resender->publisher->send(&byte, 1), Error::kOk);
  }
};
TEST(Swarmtalk, AllowsSendInsideTheSentCallback) {
  auto a = make<Kilobot>(1);
  Resender resender;
  resender.publisher =
      a->node.new_channel(0, 0, false)->new_publisher(&Resender::on_sent, &resender);
  const uint8_t byte = 1;
  resender.publisher->send(&byte, 1);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(a->pull().size(), 9u);
  EXPECT_EQ(resender.sent, 5);
}

TEST(Swarmtalk, SaysWhyAChannelIsImpossible) {
  auto a = make<Kilobot>(1);
  EXPECT_EQ(a->open(16), nullptr);
  EXPECT_EQ(a->node.last_error(), Error::kBadChannel);
  EXPECT_EQ(a->open(0, 16), nullptr);
  EXPECT_EQ(a->node.last_error(), Error::kTtlTooLarge);
  EXPECT_EQ(a->open(0, 0, true), nullptr);
  EXPECT_EQ(a->node.last_error(), Error::kWrongTimestamps);
  EXPECT_NE(a->open(0), nullptr);
  EXPECT_EQ(a->open(0), nullptr);
  EXPECT_EQ(a->node.last_error(), Error::kAlreadyOpen);
}

TEST(Swarmtalk, DeliversAndForwardsACopyOnlyOnce) {
  auto a = make<Kilobot>(1);
  auto b = make<Kilobot>(2);
  a->open(3, 5);
  b->open(3, 5);
  a->publisher->send(pattern(20).data(), 20);
  const auto packets = a->pull_all();
  for (const Bytes& packet : packets) b->hear(packet);
  for (const Bytes& packet : packets) b->hear(packet);
  const auto forwarded = b->pull_all();
  for (const Bytes& packet : packets) b->hear(packet);
  EXPECT_EQ(forwarded.size(), 4u);
  EXPECT_TRUE(b->pull_all().empty());
  EXPECT_EQ(b->received.size(), 1u);
  for (const Bytes& packet : forwarded) a->hear(packet);
  EXPECT_TRUE(a->received.empty());
  EXPECT_EQ(a->node.counters().own_echoes, 4u);
}

TEST(Swarmtalk, ChangesItsIdWhenANeighbourUsesIt) {
  auto a = std::make_unique<TestNode<Kilobot>>();
  auto b = std::make_unique<TestNode<Kilobot>>();
  b->port.next_random = a->port.next_random;
  a->open(0);
  b->open(0);
  ASSERT_EQ(a->node.node_id(), b->node.node_id());
  const auto before = b->node.node_id();
  a->publisher->send(pattern(5).data(), 5);
  b->hear(a->pull());
  EXPECT_NE(b->node.node_id(), before);
  EXPECT_EQ(b->node.counters().id_collisions, 1);
  EXPECT_EQ(b->node.counters().id_changes, 1);
}

/// What has lost no TTL was sent on by nobody.
TEST(Swarmtalk, FindsATwinNextDoorWithItsFirstFlood) {
  auto a = std::make_unique<TestNode<Kilobot>>();
  auto b = std::make_unique<TestNode<Kilobot>>();
  b->port.next_random = a->port.next_random;
  a->open(0, 3);
  b->open(0, 3);
  const auto publish = [](TestNode<Kilobot>& node) {
    node.publisher->send(pattern(5).data(), 5);
    return node.pull();
  };
  const Bytes first_of_a = publish(*a);
  publish(*b);  // lost
  ASSERT_EQ(a->node.node_id(), b->node.node_id());
  b->hear(first_of_a);
  EXPECT_EQ(b->node.counters().id_collisions, 1);
  EXPECT_EQ(b->node.counters().own_echoes, 0);
  EXPECT_NE(a->node.node_id(), b->node.node_id());
}

/// Sent on, floods of a twin look like echoes under the eight numbers that both have sent last.
/// docs/decisions/0011 gives this as the bound.
TEST(Swarmtalk, FindsATwinFartherOffWithinHalfOfTheNumbers) {
  TestNode<Kilobot> a(7);
  TestNode<Kilobot> b(7);
  a.open(0, 3);
  b.open(0, 3);
  const auto publish = [](TestNode<Kilobot>& node) {
    node.publisher->send(pattern(5).data(), 5);
    return node.pull();
  };
  publish(b);
  std::vector<Bytes> by_way_of_another;
  for (int n = 0; n < 9; ++n) {
    TestNode<Kilobot> between(9);
    between.open(0, 3);
    between.hear(publish(a));
    by_way_of_another.push_back(between.pull());
  }
  b.hear(by_way_of_another[0]);
  EXPECT_EQ(b.node.counters().own_echoes, 1);
  EXPECT_EQ(b.node.counters().id_collisions, 0);
  for (const Bytes& packet : by_way_of_another) b.hear(packet);
  EXPECT_EQ(b.node.counters().id_collisions, 8);
}

/// Where numbers do not return, its sender repeats a message when it sends it again.
TEST(Swarmtalk, TakesAMessageSentAgainForACopyThoughAForwarderWasHeardFirst) {
  auto origin = std::make_unique<TestNode<Wifi>>(uint16_t{1});
  auto between = std::make_unique<TestNode<Wifi>>(uint16_t{2});
  auto hearer = std::make_unique<TestNode<Wifi>>(uint16_t{3});
  Channel<Wifi>* const channel = origin->open(0, 3);
  between->open(0, 3);
  hearer->open(0, 3);
  origin->publisher->send(pattern(5).data(), 5);
  between->hear(origin->pull());
  hearer->hear(between->pull());
  ASSERT_EQ(hearer->received.size(), 1u);
  ASSERT_EQ(channel->send_again(), Error::kOk);
  hearer->hear(origin->pull());
  EXPECT_EQ(hearer->received.size(), 1u);
  EXPECT_EQ(hearer->node.counters().duplicates, 1u);
}

TEST(Swarmtalk, CountsDamage) {
  auto a = make<Kilobot>(1);
  EXPECT_EQ(a->hear(Bytes{1, 2, 3}), Error::kBadPacket);
  EXPECT_EQ(a->hear(Bytes(9, 1)), Error::kBadChecksum);
  EXPECT_EQ(a->node.counters().bad_packets, 1);
  EXPECT_EQ(a->node.counters().bad_checksums, 1);
}

TEST(SwarmtalkWifi, ConstructionLeavesItsBuffersUntouched) {
  constexpr size_t kSize = sizeof(Swarmtalk<Wifi>);
  std::vector<uint8_t> memory(kSize + 64, 0xA5);
  testing::TestPort port;
  void* at = memory.data() + (64 - reinterpret_cast<uintptr_t>(memory.data()) % 64);
  new (at) Swarmtalk<Wifi>(port.port());
  size_t touched = 0;
  for (uint8_t byte : memory) touched += byte != 0xA5;
  EXPECT_LT(touched, 16384u) << "of " << kSize;
}

}  // namespace
}  // namespace swarmtalk::core
