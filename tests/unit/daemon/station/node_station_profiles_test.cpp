// Stations of each profile, joined by hand: what the head of a message says that came over one.
#include <gtest/gtest.h>

#include <cmath>

#include "daemon/station/node_station.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class HeardUser final : public StationUser {
 public:
  void on_message(Station&, const MessageHead& head, std::span<const std::uint8_t> bytes) override {
    heads.push_back(head);
    payloads.emplace_back(bytes.begin(), bytes.end());
  }
  void on_sent(Station&, std::uint16_t channel) override { sent.push_back(channel); }
  void on_namesake(Station&) override {}
  void on_link_state(Station&) override { ++states; }

  std::vector<MessageHead> heads;
  std::vector<std::string> payloads;
  std::vector<std::uint16_t> sent;
  int states = 0;
};

constexpr std::uint16_t kHere = 3;  // the channel

template <class P>
struct End {
  End(frame::ProfileId profile, std::uint16_t id) : identity(id), name{profile, "a profile"} {
    station.start();
    EXPECT_TRUE(station.open_channel(kHere, false));
    station.set_listening(kHere, true);
  }
  SendResult send(const std::string& text, std::uint8_t ttl = 0,
                  const GatewayOrigin* origin = nullptr, std::uint32_t wished = 0) {
    number = wished;
    return station.send(kHere, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()},
                        ttl, origin, 0, number);
  }
  /// All that waits here is heard there. @param change  of each packet, on the air
  void transmit_to(End& other, std::optional<float> distance_m = std::nullopt,
                   const std::function<void(std::vector<std::uint8_t>&)>& change = {}) {
    for (std::vector<std::uint8_t> packet : link->pull_all()) {
      if (change) change(packet);
      drivers::FrameReception frame;
      frame.transmitter = identity.id();
      frame.transmitter_epoch = identity.epoch();
      frame.received_at = std::chrono::steady_clock::now();
      frame.distance_m = distance_m;
      other.link->hand_up(packet, frame);
    }
  }
  std::uint64_t counter(const std::string& wanted) {
    for (const auto& [each, value] : station.counters()) {
      if (each == wanted) return value;
    }
    ADD_FAILURE() << "no counter " << wanted;
    return 0;
  }

  NodeIdentity identity;
  ProfileName name;
  PoseKeeper poses{NodeConfig{}};
  HeardUser user;
  FakeLink* link = new FakeLink;
  NodeStation<P> station{"s", name, std::unique_ptr<drivers::Link>(link), identity, poses, user};
  std::uint32_t number = 0;
};

template <class P>
void exchange(frame::ProfileId profile) {
  End<P> a(profile, 1), b(profile, 2), c(profile, 3);
  EXPECT_STREQ(a.station.profile(), "a profile");
  EXPECT_EQ(a.link->user().frame_header().profile, profile);
  const std::string text(a.station.limits().max_message_bytes, 'x');
  ASSERT_EQ(a.send(text, 2), SendResult::kSent);
  EXPECT_EQ(a.send("y"), SendResult::kBusy);
  EXPECT_EQ(a.number, 0u) << "of what is not taken none is told";
  a.transmit_to(b, 0.25F);
  EXPECT_EQ(a.user.sent, std::vector<std::uint16_t>{kHere});
  ASSERT_EQ(b.user.heads.size(), 1u);
  const MessageHead& head = b.user.heads[0];
  EXPECT_EQ(b.user.payloads[0], text);
  EXPECT_EQ(head.channel, kHere);
  EXPECT_EQ(head.sender, 1);
  EXPECT_EQ(head.distance_m, 0.25F) << "as the link measured it";
  EXPECT_TRUE(std::isnan(head.bearing_rad));
  EXPECT_EQ(head.hops, 0);
  EXPECT_FALSE(head.crossed_gateway);
  EXPECT_EQ(head.has_wide_number, profile == frame::ProfileId::kWifi);
  EXPECT_EQ(head.transmitter, 0) << "it is the sender";
  b.transmit_to(c);
  ASSERT_EQ(c.user.heads.size(), 1u);
  EXPECT_TRUE(std::isnan(c.user.heads[0].distance_m));
  EXPECT_EQ(c.user.heads[0].sender, 1);
  EXPECT_EQ(c.user.heads[0].transmitter, 2);
  EXPECT_EQ(b.counter("node_packets_forwarded") > 0, true);
  ASSERT_EQ(a.send("y"), SendResult::kSent);
  a.transmit_to(b);
  ASSERT_EQ(b.user.heads.size(), 2u);
  EXPECT_EQ(b.user.payloads[1].substr(0, 1), "y");
}

TEST(StationOfKilobots, BringsMessagesWithWhatIsKnownOfThem) {
  exchange<HostedKilobot>(frame::ProfileId::kKilobot);
}
TEST(StationOfClassic2020, BringsMessagesWithWhatIsKnownOfThem) {
  exchange<HostedClassic2020>(frame::ProfileId::kClassic2020);
}
TEST(StationOfFootbots, BringsMessagesWithWhatIsKnownOfThem) {
  exchange<HostedFootbot>(frame::ProfileId::kFootbot);
}
TEST(StationOfWifi, BringsMessagesWithWhatIsKnownOfThem) {
  exchange<core::Wifi>(frame::ProfileId::kWifi);
}

TEST(StationOfKilobots, TakesASenderWithAGatewaysIdForOneThatCrossed) {
  const std::uint16_t first = limits_of_profile<HostedKilobot>().first_gateway_id;
  ASSERT_GT(first, 1);
  for (const std::uint16_t id : {std::uint16_t(first - 1), first}) {
    End<HostedKilobot> a(frame::ProfileId::kKilobot, id), b(frame::ProfileId::kKilobot, 1);
    ASSERT_EQ(a.send("x"), SendResult::kSent);
    a.transmit_to(b);
    ASSERT_EQ(b.user.heads.size(), 1u);
    EXPECT_EQ(b.user.heads[0].crossed_gateway, id >= first) << id;
    EXPECT_FALSE(b.user.heads[0].origin);
  }
}

TEST(StationOfWifi, BringsWhereAMessageCameFromThatCrossedAGateway) {
  End<core::Wifi> a(frame::ProfileId::kWifi, 1), b(frame::ProfileId::kWifi, 2);
  const GatewayOrigin origin{"table", 7, 9, 12};
  ASSERT_EQ(a.send("hello", 0, &origin), SendResult::kSent);
  a.transmit_to(b);
  ASSERT_EQ(b.user.heads.size(), 1u);
  EXPECT_TRUE(b.user.heads[0].crossed_gateway);
  EXPECT_EQ(b.user.heads[0].origin, origin);
  EXPECT_EQ(b.user.payloads[0], "hello");
  ASSERT_EQ(a.send("hello", 0, &origin), SendResult::kSent);
  a.transmit_to(b, std::nullopt, [](std::vector<std::uint8_t>& packet) {
    const auto name = std::search(packet.begin(), packet.end(), "table", "table" + 5);
    ASSERT_NE(name, packet.end());
    *name = 0xFF;  // no UTF-8
  });
  EXPECT_EQ(b.user.heads.size(), 1u);
  EXPECT_EQ(b.counter("node_bad_origins"), 1u);
  ASSERT_EQ(a.send("plain"), SendResult::kSent);
  a.transmit_to(b);
  ASSERT_EQ(b.user.heads.size(), 2u);
  EXPECT_FALSE(b.user.heads[1].crossed_gateway);
  EXPECT_FALSE(b.user.heads[1].origin);
}

TEST(StationOfWifi, GoesOnUnderTheNumberThatAnotherLinkHasReached) {
  End<core::Wifi> a(frame::ProfileId::kWifi, 1), b(frame::ProfileId::kWifi, 2);
  ASSERT_EQ(a.send("1"), SendResult::kSent);
  EXPECT_EQ(a.number, 1u);
  a.transmit_to(b);
  ASSERT_EQ(a.send("5", 0, nullptr, 5), SendResult::kSent);
  EXPECT_EQ(a.number, 5u);
  a.transmit_to(b);
  ASSERT_EQ(a.send("6", 0, nullptr, 6), SendResult::kSent);
  a.transmit_to(b);
  ASSERT_EQ(a.send("7", 0, nullptr, 2), SendResult::kSent);
  EXPECT_EQ(a.number, 7u) << "never back";
  a.transmit_to(b);
  std::vector<std::uint32_t> numbers;
  for (const MessageHead& each : b.user.heads) numbers.push_back(each.number);
  EXPECT_EQ(numbers, (std::vector<std::uint32_t>{1, 5, 6, 7}));
}

TEST(StationOfWifi, TellsItsUserWhenTheLinkChanges) {
  End<core::Wifi> a(frame::ProfileId::kWifi, 1);
  EXPECT_TRUE(a.station.is_up());
  a.link->up = false;
  a.link->user().on_link_state();
  EXPECT_FALSE(a.station.is_up());
  EXPECT_EQ(a.user.states, 1);
}

}  // namespace
}  // namespace swarmtalk::daemon
