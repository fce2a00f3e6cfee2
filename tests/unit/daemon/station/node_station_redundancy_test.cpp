// Repair packets of stations with real nodes: asked for, sent, sent on, and what they bring back.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "daemon/message/redundancy.hpp"
#include "daemon/station/node_station.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using Packet = std::vector<std::uint8_t>;
using Frame = std::vector<Packet>;

constexpr ProfileName kRepairedProfile{frame::ProfileId::kWifi, "wifi"};
constexpr std::uint16_t kRepairedChannel = 7;
constexpr std::size_t kFrameRoom = 1480;

/// A station alone, whose link is filled frame by frame.
struct Repaired final : StationUser {
  explicit Repaired(std::uint16_t id, bool is_listening = true) : identity(id) {
    station.start();
    station.set_forwarding({});
    EXPECT_TRUE(station.open_channel(kRepairedChannel, false));
    station.set_listening(kRepairedChannel, is_listening);
  }
  void on_message(Station&, const MessageHead& head,
                  std::span<const std::uint8_t> payload) override {
    heard.emplace_back(payload.begin(), payload.end());
    numbers.push_back(head.number);
  }
  void on_sent(Station&, std::uint16_t) override {
    if (next_size == 0) return;
    send(std::exchange(next_size, 0), next_redundancy);
  }
  void on_namesake(Station&) override {}

  void send(std::size_t size, std::uint8_t redundancy, std::uint8_t ttl = 0) {
    Packet payload(size);
    for (std::size_t i = 0; i < size; ++i) payload[i] = static_cast<std::uint8_t>(i * 7 + size);
    if (redundancy != 0) station.protect_next(redundancy);
    std::uint32_t number = 0;
    EXPECT_EQ(station.send(kRepairedChannel, payload, ttl, nullptr, 0, number), SendResult::kSent);
    sent = payload;
  }
  std::vector<Frame> frames() {
    std::vector<Frame> made;
    drivers::LinkUser& user = link->user();
    while (user.next_packet_bytes() > 0) {
      Frame& frame = made.emplace_back();
      user.frame_header();
      std::size_t room = kFrameRoom;
      Packet out(room);
      while (const std::size_t size = user.pull_packet(std::span(out).first(room))) {
        frame.emplace_back(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(size));
        room -= size + 2;
      }
      if (frame.empty()) {
        ADD_FAILURE() << "something waits and nothing leaves";
        break;
      }
    }
    return made;
  }
  void hear(const Frame& frame, Repaired& from) {
    const frame::FrameHeader header = from.station.frame_header();
    drivers::FrameReception reception;
    reception.transmitter = header.node;
    reception.transmitter_epoch = header.epoch;
    reception.frame_counter = ++counter;
    reception.received_at = std::chrono::steady_clock::now();
    for (const Packet& packet : frame) link->hand_up(packet, reception);
  }
  std::uint64_t count(std::string_view name) const {
    for (const auto& [each, value] : station.counters()) {
      if (each == name) return value;
    }
    ADD_FAILURE() << "no counter " << name;
    return 0;
  }

  NodeIdentity identity;
  PoseKeeper poses{NodeConfig{}};
  FakeLink* link = new FakeLink;
  NodeStation<core::Wifi> station{
      "w", kRepairedProfile, std::unique_ptr<drivers::Link>(link), identity, poses, *this};
  std::vector<Packet> heard;
  std::vector<std::uint32_t> numbers;
  Packet sent;
  std::size_t next_size = 0;
  std::uint8_t next_redundancy = 0;
  std::uint32_t counter = 0;
};

TEST(NodeStationRedundancy, AnyLossOfAsManyFramesIsMadeUpFor) {
  for (unsigned lost = 0; lost < 1u << 5; ++lost) {
    if (__builtin_popcount(lost) != 2) continue;
    Repaired a(1);
    Repaired b(2);
    a.send(3 * 1383, 2);
    const std::vector<Frame> frames = a.frames();
    ASSERT_EQ(frames.size(), 5u);
    for (unsigned i = 0; i < frames.size(); ++i) {
      if ((lost >> i & 1) == 0) b.hear(frames[i], a);
    }
    ASSERT_EQ(b.heard.size(), 1u) << lost;
    EXPECT_EQ(b.heard[0], a.sent);
    EXPECT_EQ(b.count("node_bad_packets"), 0u) << "parity packets are none";
    EXPECT_EQ(a.count("repairs_sent"), 2u);
    const auto known = static_cast<unsigned>(__builtin_popcount(lost & 7));
    EXPECT_EQ(b.count("packets_recovered"), known);
  }
}

TEST(NodeStationRedundancy, NothingIsMadeWhereNobodyAsks) {
  Repaired a(1);
  a.send(3 * 1383, 0);
  EXPECT_EQ(a.frames().size(), 3u);
  a.send(20, 0);
  EXPECT_EQ(a.frames().size(), 1u);
  EXPECT_EQ(a.count("repairs_sent"), 0u);
}

// The next message is handed over while the last packet of this one is on its way out.
TEST(NodeStationRedundancy, OfAMessageThatTheNextOneFollowsAtOnce) {
  Repaired a(1);
  Repaired b(2);
  a.next_size = 24;
  a.next_redundancy = 1;
  a.send(2 * 1383, 1);
  const std::vector<Frame> frames = a.frames();
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[1].size(), 2u) << "the small one leaves with the long one's end";
  EXPECT_EQ(frames[2].size(), 2u) << "and its copy with the long one's parity packet";
  for (std::size_t i = 1; i < frames.size(); ++i) b.hear(frames[i], a);
  EXPECT_EQ(b.heard.size(), 2u);
}

TEST(NodeStationRedundancy, AForwarderSendsOnWhatItHeardOnceAndMakesNothing) {
  Repaired a(1);
  Repaired relay(2, false);
  Repaired b(3);
  a.send(2 * 1383, 2, 3);
  const std::vector<Frame> frames = a.frames();
  ASSERT_EQ(frames.size(), 4u);
  relay.hear(frames[0], a);
  for (int copies = 0; copies < 3; ++copies) relay.hear(frames[2], a);
  const std::vector<Frame> sent_on = relay.frames();
  EXPECT_EQ(sent_on.size(), 2u);
  EXPECT_EQ(relay.count("repairs_forwarded"), 1u);
  relay.hear(frames[2], a);
  EXPECT_TRUE(relay.frames().empty());
  for (const Frame& frame : sent_on) b.hear(frame, relay);
  ASSERT_EQ(b.heard.size(), 1u);
  EXPECT_EQ(b.heard[0], a.sent);
  for (const Frame& frame : sent_on) a.hear(frame, relay);
  EXPECT_TRUE(a.frames().empty()) << "its own come back";
  relay.station.set_forwarding({false, 16, 5000});
  relay.hear(frames[3], a);
  EXPECT_TRUE(relay.frames().empty());
}

TEST(NodeStationRedundancy, ParityPacketsAreOfWhoseMessageTheyBelongTo) {
  Repaired a(1);
  Repaired other(2);
  a.send(2 * 1383, 2, 3);
  other.send(2 * 1383, 2, 3);
  const std::vector<Frame> others = other.frames();
  ASSERT_EQ(others.size(), 4u);
  Packet out(kFrameRoom);
  for (int i = 0; i < 2; ++i) {
    a.link->user().frame_header();
    ASSERT_GT(a.link->user().pull_packet(out), 0u);
  }
  a.hear(others[0], other);
  EXPECT_FALSE(a.station.has_forwards_only()) << "our own parity packets wait as well";
  a.frames();
  a.hear(others[2], other);
  EXPECT_TRUE(a.station.has_forwards_only()) << "a parity packet to be sent on";
}

TEST(NodeStationRedundancy, ALateCopyIsHeardOnce) {
  Repaired a(1);
  Repaired b(2);
  Repaired c(3);
  a.send(24, 1);
  const Frame first = a.frames().at(0);
  EXPECT_TRUE(a.frames().empty()) << "it waits for a frame";
  a.send(30, 0);
  const Frame second = a.frames().at(0);
  ASSERT_EQ(second.size(), 2u);
  EXPECT_EQ(second[0], first[0]);
  b.hear(first, a);
  b.hear(second, a);
  EXPECT_EQ(b.numbers, (std::vector<std::uint32_t>{1, 2}));
  c.hear(second, a);
  EXPECT_EQ(c.numbers, (std::vector<std::uint32_t>{1, 2})) << "in order";
}

TEST(NodeStationRedundancy, FollowsTheLossOfNeighbours) {
  Repaired alone(3);
  alone.send(4 * 1383, kAutoRedundancy);
  EXPECT_EQ(alone.frames().size(), 4u) << "nothing is lost as far as it knows";
  Repaired a(1);
  Repaired b(2);
  // One of five frames of the neighbour does not come.
  b.send(10, 0);
  const Frame frame = b.frames().at(0);
  for (int i = 0; i < 40; ++i) {
    if (i % 4 == 0) ++a.counter;
    a.hear(frame, b);
  }
  a.send(4 * 1383, kAutoRedundancy);
  EXPECT_EQ(a.frames().size(), 7u);
}

TEST(NodeStationRedundancy, AMessageThatIsGivenUpLeavesNothingBehind) {
  Repaired a(1);
  a.send(3 * 1383, 2);
  a.station.cancel(kRepairedChannel);
  a.send(2 * 1383, 0);
  EXPECT_EQ(a.frames().size(), 2u);
}

}  // namespace
}  // namespace swarmtalk::daemon
