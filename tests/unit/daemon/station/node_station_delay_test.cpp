// What a station measures and counts for the two ends of a message: its delay, its number, its
// copies.
#include <gtest/gtest.h>

#include <array>

#include "daemon/station/node_station.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;
constexpr ProfileName kDelayProfile{frame::ProfileId::kWifi, "wifi"};
constexpr std::uint16_t kChannel = 7;

/// A station alone: its user remembers what it is told.
struct Lone final : StationUser {
  Lone(std::uint16_t id, bool is_timestamped) : identity(id), timestamped(is_timestamped) {
    station.start();
    EXPECT_TRUE(station.open_channel(kChannel, timestamped));
    station.set_listening(kChannel, true);
  }

  void on_message(Station&, const MessageHead& head, std::span<const std::uint8_t>) override {
    heard.push_back(head);
  }
  void on_sent(Station&, std::uint16_t) override { ++sent; }
  void on_namesake(Station&) override {}

  std::uint32_t send(std::size_t size, std::uint64_t waited_us = 0, std::uint8_t ttl = 0) {
    const std::vector<std::uint8_t> payload(size, 'x');
    std::uint32_t number = 0;
    EXPECT_EQ(station.send(kChannel, payload, ttl, nullptr, waited_us, number), SendResult::kSent);
    return number;
  }
  void transmit_to(Lone& other, std::chrono::microseconds ago = 0us) {
    for (const auto& packet : link->pull_all()) {
      const frame::FrameHeader header = station.frame_header();
      drivers::FrameReception reception;
      reception.transmitter = header.node;
      reception.transmitter_epoch = header.epoch;
      reception.received_at = std::chrono::steady_clock::now() - ago;
      other.link->hand_up(packet, reception);
    }
  }

  NodeIdentity identity;
  PoseKeeper poses{NodeConfig{}};
  bool timestamped;
  FakeLink* link = new FakeLink;
  NodeStation<core::Wifi> station{"w",      kDelayProfile, std::unique_ptr<drivers::Link>(link),
                                  identity, poses,         *this};
  std::vector<MessageHead> heard;
  int sent = 0;
};

TEST(NodeStationDelay, CountsFromTheProgramsSend) {
  Lone a(1, true);
  Lone b(2, true);
  a.send(100, 3'000'000);
  a.transmit_to(b);
  ASSERT_EQ(b.heard.size(), 1u);
  EXPECT_GE(*b.heard[0].buffering_delay_us, 3'000'000u);
  EXPECT_LT(*b.heard[0].buffering_delay_us, 4'000'000u);
}

TEST(NodeStationDelay, EndsAtTheKernelsStamp) {
  Lone a(1, true);
  Lone b(2, true);
  a.send(100);
  a.transmit_to(b, 5s);
  EXPECT_LT(*b.heard[0].buffering_delay_us, 1'000'000u);
}

TEST(NodeStationDelay, OfAForwarderHoldsTheWaitInItsSocket) {
  Lone a(1, true);
  Lone relay(2, true);
  Lone b(3, true);
  a.send(100, 0, 1);
  a.transmit_to(relay, 2s);
  relay.transmit_to(b);
  ASSERT_EQ(b.heard.size(), 1u);
  EXPECT_GE(*b.heard[0].buffering_delay_us, 2'000'000u);
  EXPECT_LT(*b.heard[0].buffering_delay_us, 3'000'000u);
}

TEST(NodeStationDelay, StaysSaneWhenStampsOverlapPulls) {
  Lone a(1, true);
  Lone b(2, true);
  b.send(1, 0, 1);
  b.link->pull_all();  // the node has heard a later time
  a.send(3000);        // three packets
  a.transmit_to(b, 100ms);
  ASSERT_EQ(b.heard.size(), 1u);
  EXPECT_LT(*b.heard[0].buffering_delay_us, 1'000'000u);
}

TEST(NodeStationNumbers, GoOnWhereAChannelHadBeenClosed) {
  Lone a(1, false);
  EXPECT_EQ(a.send(1), 1u);
  a.link->pull_all();
  a.station.close_channel(kChannel);
  for (std::uint16_t other = 100; other < 110; ++other) {
    ASSERT_TRUE(a.station.open_channel(other, false));
    a.station.close_channel(other);
  }
  ASSERT_TRUE(a.station.open_channel(kChannel, false));
  EXPECT_EQ(a.send(1), 2u);
  Lone b(2, false);
  a.transmit_to(b);
  ASSERT_EQ(b.heard.size(), 1u);
  EXPECT_EQ(b.heard[0].number, 2u);
}

TEST(NodeStationNumbers, OfACancelledMessageThatNobodyHeardIsUsedAgain) {
  Lone a(1, false);
  EXPECT_EQ(a.send(1), 1u);
  a.station.cancel(kChannel);
  EXPECT_EQ(a.send(1), 1u);
  Lone b(2, false);
  a.transmit_to(b);
  EXPECT_EQ(b.heard[0].number, 1u);
}

TEST(NodeStationNumbers, OfACancelledMessageThatHadBegunIsSpent) {
  Lone a(1, false);
  a.send(3000);
  std::vector<std::uint8_t> out(1400);
  EXPECT_GT(a.station.pull_packet(out), 0u);
  a.station.cancel(kChannel);
  std::array<frame::LastMessage, 1> last{};
  ASSERT_EQ(a.station.last_messages(last), 1u) << "its loss is told as that of any other";
  EXPECT_EQ(last[0].number, 1u);
  EXPECT_EQ(a.send(1), 2u);
}

TEST(NodeStationNumbers, OfAMessageWhoseNextCopyIsCancelledIsSpent) {
  Lone a(1, false);
  Lone b(2, false);
  a.send(1);
  a.transmit_to(b);
  ASSERT_TRUE(a.station.send_again(kChannel));
  a.station.cancel(kChannel);
  EXPECT_EQ(a.send(1), 2u);
  a.transmit_to(b);
  EXPECT_EQ(b.heard.size(), 2u) << "a copy of the first";
  a.station.cancel(kChannel);
  EXPECT_EQ(a.send(1), 3u);
  a.station.cancel(kChannel);
  EXPECT_EQ(a.send(1), 3u) << "nobody has heard of this one";
}

TEST(NodeStationCopies, AreHeardOnceAndEachEndsWithSent) {
  Lone a(1, false);
  Lone b(2, false);
  a.send(3000);
  a.transmit_to(b);
  ASSERT_TRUE(a.station.send_again(kChannel));
  a.transmit_to(b);
  EXPECT_EQ(b.heard.size(), 1u);
  EXPECT_EQ(a.sent, 2);
}

TEST(NodeStationCopies, FillInForPacketsThatWereLost) {
  Lone a(1, false);
  Lone b(2, false);
  a.send(3000);
  std::vector<std::uint8_t> lost(1400);
  EXPECT_GT(a.station.pull_packet(lost), 0u);
  a.transmit_to(b);
  EXPECT_TRUE(b.heard.empty());
  ASSERT_TRUE(a.station.send_again(kChannel));
  a.transmit_to(b);
  ASSERT_EQ(b.heard.size(), 1u);
  EXPECT_EQ(b.heard[0].number, 1u);
}

TEST(NodeStationCopies, AreNotSentByAChannelThatHasBeenMadeAnewInBetween) {
  Lone a(1, false);
  Lone b(2, false);
  a.station.set_listening(kChannel, true);
  a.send(3000);
  a.transmit_to(b);
  a.station.set_listening(kChannel, false);  // its last subscriber has left
  EXPECT_FALSE(a.station.send_again(kChannel));
  EXPECT_EQ(a.station.next_packet_bytes(), 0u);
  EXPECT_EQ(a.send(10), 2u);
  a.transmit_to(b);
  ASSERT_TRUE(a.station.send_again(kChannel));
}

TEST(NodeStationForwards, AreAllThatWaitsUntilSomethingOfOurOwnDoes) {
  Lone a(1, false);
  Lone relay(2, false);
  EXPECT_FALSE(relay.station.has_forwards_only()) << "nothing waits";
  a.send(10, 0, 1);
  a.transmit_to(relay);
  EXPECT_TRUE(relay.station.has_forwards_only());
  relay.send(3000);
  EXPECT_FALSE(relay.station.has_forwards_only());
  relay.station.cancel(kChannel);
  EXPECT_TRUE(relay.station.has_forwards_only());
  relay.send(10);
  EXPECT_FALSE(relay.station.has_forwards_only());
  relay.link->pull_all();
  EXPECT_FALSE(relay.station.has_forwards_only()) << "nothing waits any more";
  a.send(10, 0, 1);
  a.transmit_to(relay);
  EXPECT_TRUE(relay.station.has_forwards_only()) << "what was our own has left";
  ASSERT_TRUE(relay.station.send_again(kChannel));
  EXPECT_FALSE(relay.station.has_forwards_only());
  relay.station.close_channel(kChannel);
  EXPECT_TRUE(relay.station.has_forwards_only());
}

TEST(NodeStationPull, LeavesAPacketThatDoesNotFit) {
  Lone a(1, false);
  a.send(500);
  std::vector<std::uint8_t> out(1400);
  const std::size_t needed = a.station.next_packet_bytes();
  EXPECT_GT(needed, 500u);
  EXPECT_EQ(a.station.pull_packet(std::span(out).first(needed - 1)), 0u);
  EXPECT_EQ(a.station.pull_packet(std::span(out).first(needed)), needed);
  EXPECT_EQ(a.station.next_packet_bytes(), 0u);
}

TEST(NodeStationPull, KnowsTheLengthOfEveryPacket) {
  Lone a(1, true);
  Lone b(2, true);
  std::vector<std::uint8_t> out(1400);
  for (const std::size_t size : {0u, 1u, 1300u, 1400u, 3000u, 16000u}) {
    a.send(size, 0, 1);
    while (const std::size_t expected = a.station.next_packet_bytes()) {
      ASSERT_EQ(a.station.pull_packet(out), expected) << "message of " << size;
      drivers::FrameReception reception;
      reception.received_at = std::chrono::steady_clock::now();
      b.link->hand_up({out.begin(), out.begin() + static_cast<std::ptrdiff_t>(expected)},
                      reception);
      ASSERT_EQ(b.station.next_packet_bytes(), expected);  // to forward
      ASSERT_EQ(b.station.pull_packet(out), expected);
    }
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
