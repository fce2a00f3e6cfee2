// Two stations with real nodes, joined by hand: what one link pulls the other hands up.
#include "daemon/station/node_station.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "daemon/hub/hub.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr ProfileName kWifi{frame::ProfileId::kWifi, "wifi"};

NodeConfig at(double x_m, double y_m, double theta_rad) {
  NodeConfig config;
  config.pose = FixedPose{x_m, y_m, theta_rad};
  return config;
}

/// One robot: hub, station on a core node, one client with a publisher and a subscription.
struct Robot {
  Robot(std::optional<std::uint16_t> id, const NodeConfig& pose, bool is_timestamped = false)
      : identity(id), poses(pose) {
    hub.add(station);
    station.start();
    publisher.client = &client;
    subscription.client = &client;
    EXPECT_FALSE(hub.advertise({"c", std::nullopt, is_timestamped}, publisher));
    EXPECT_FALSE(hub.subscribe({"c", std::nullopt, std::nullopt}, subscription));
  }

  drivers::FrameReception frame() {
    const frame::FrameHeader header = station.frame_header();
    drivers::FrameReception reception;
    reception.transmitter = header.node;
    reception.transmitter_epoch = header.epoch;
    reception.pose = header.pose;
    reception.received_at = std::chrono::steady_clock::now();
    return reception;
  }
  bool publish(std::string payload, std::uint32_t ttl = 0) {
    return !hub.publish(publisher, 1, payload, ttl);
  }
  /// Everything that waits here is heard there.
  void transmit_to(Robot& other) {
    for (const auto& packet : link->pull_all()) other.link->hand_up(packet, frame());
  }

  ChannelTable names{{}};
  LimitsConfig limits;
  DaemonCounters counters;
  NodeIdentity identity;
  PoseKeeper poses;
  Hub hub{names, limits, counters, identity};
  FakeLink* link = new FakeLink;
  NodeStation<core::Wifi> station{"w",      kWifi, std::unique_ptr<drivers::Link>(link),
                                  identity, poses, hub};
  FakeClient client;
  Publisher publisher;
  Subscription subscription;
};

std::uint64_t counter(const Station& station, const std::string& name) {
  for (const auto& [each, value] : station.counters()) {
    if (each == name) return value;
  }
  ADD_FAILURE() << "no counter " << name;
  return 0;
}

TEST(NodeStation, MessageCrossesWithOriginDistanceAndBearing) {
  Robot a(1, at(0, 0, 0));
  Robot b(2, at(3, 4, std::numbers::pi));
  ASSERT_TRUE(a.publish("hello"));
  EXPECT_EQ(a.link->wakes, 1);
  a.transmit_to(b);
  EXPECT_EQ(a.client.sent.size(), 1u);
  ASSERT_EQ(b.client.heard.size(), 1u);
  const Message& message = *b.client.last;
  EXPECT_EQ(message.payload, "hello");
  EXPECT_EQ(message.sender, 1);
  EXPECT_EQ(message.epoch, a.identity.epoch() & 0xFFFF);
  EXPECT_EQ(message.number, 1u);
  EXPECT_EQ(message.hops, 0);
  EXPECT_NEAR(message.distance_m, 5.0, 1e-3);
  EXPECT_NEAR(message.bearing_rad, std::atan2(4.0, 3.0), 1e-3);  // looking back along -x
  EXPECT_FALSE(message.is_local);
  EXPECT_FALSE(message.buffering_delay_us);
}

TEST(NodeStation, PacketToForwardWakesTheLinkOfARobotThatSendsNothing) {
  Robot a(1, NodeConfig{});
  Robot relay(2, NodeConfig{});
  Robot b(3, NodeConfig{});
  a.publish("on", 1);
  a.transmit_to(relay);
  EXPECT_EQ(relay.link->wakes, 1);
  relay.transmit_to(b);
  ASSERT_EQ(b.client.heard.size(), 1u);
  EXPECT_EQ(b.client.last->hops, 1);
}

TEST(NodeStation, PacketThatIsNotForwardedDoesNotWakeTheLink) {
  Robot a(1, NodeConfig{});
  Robot b(2, NodeConfig{});
  a.publish("here", 0);
  a.transmit_to(b);
  EXPECT_EQ(b.link->wakes, 0);
}

TEST(NodeStation, SmallerPacketsOfTheLinkLimitMessagesToOnePacket) {
  Robot a(1, NodeConfig{}, true);
  const auto most = a.station.limits();
  EXPECT_EQ(a.station.message_bytes_that_fit(false), most.max_message_bytes);
  EXPECT_EQ(a.station.message_bytes_that_fit(true), most.max_timestamped_message_bytes);
  a.link->packet_limit = 955;
  const std::size_t fits = a.station.message_bytes_that_fit(true);
  ASSERT_TRUE(a.publish(std::string(fits, 'x')));
  const auto packets = a.link->pull_all();
  ASSERT_EQ(packets.size(), 1u);
  EXPECT_EQ(packets[0].size(), 955u);
  EXPECT_FALSE(a.publish(std::string(fits + 1, 'x')));
  EXPECT_TRUE(a.link->pull_all().empty());
}

TEST(NodeStation, LinkWithTinyPacketsFitsNothing) {
  Robot a(1, NodeConfig{});
  a.link->packet_limit = 3;
  EXPECT_EQ(a.station.message_bytes_that_fit(false), 0u);
}

TEST(NodeStation, WithoutAPoseDistanceIsUnknown) {
  Robot a(1, NodeConfig{});
  Robot b(2, at(3, 4, 0));
  a.publish("x");
  a.transmit_to(b);
  ASSERT_EQ(b.client.heard.size(), 1u);
  EXPECT_TRUE(std::isnan(b.client.last->distance_m));
  EXPECT_TRUE(std::isnan(b.client.last->bearing_rad));
}

TEST(NodeStation, PacketsFromBeyondTheVirtualRangeAreNeitherHeardNorForwarded) {
  Robot near(1, at(0.9, 0, 0));
  Robot far(2, at(1.1, 0, 0));
  Robot lost(3, NodeConfig{});
  Robot hearer(4, at(0, 0, 0));
  hearer.station.set_virtual_range({1.0, false});
  for (Robot* sender : {&far, &near, &lost}) {
    sender->publish(std::to_string(sender->identity.id()), 1);
    sender->transmit_to(hearer);
  }
  ASSERT_EQ(hearer.client.heard.size(), 2u);
  EXPECT_EQ(std::get<1>(hearer.client.heard[0]), "1");
  EXPECT_EQ(std::get<1>(hearer.client.heard[1]), "3");
  EXPECT_EQ(hearer.link->pull_all().size(), 2u) << "what is forwarded";
  EXPECT_EQ(counter(hearer.station, "packets_too_far"), 1u);
}

TEST(NodeStation, NeighbourAtTheVirtualRangeIsHeardWhateverTheSpacingOfTheGrid) {
  for (const double spacing_m : {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2}) {
    for (int column = 0; column < 10; ++column) {
      const auto x_of = [&](int c) { return static_cast<float>(spacing_m * c); };  // as set_pose
      Robot sender(1, at(static_cast<double>(x_of(column)), 0, 0));
      Robot hearer(2, at(static_cast<double>(x_of(column + 1)), 0, 0));
      hearer.station.set_virtual_range({spacing_m, false});
      sender.publish("x");
      sender.transmit_to(hearer);
      EXPECT_EQ(hearer.client.heard.size(), 1u) << spacing_m << " m, column " << column;
      hearer.client.heard.clear();
      hearer.station.set_virtual_range({spacing_m - 0.002, false});
      sender.publish("y");
      sender.transmit_to(hearer);
      EXPECT_TRUE(hearer.client.heard.empty()) << "two millimetres beyond " << spacing_m << " m";
    }
  }
}

TEST(NodeStation, VirtualRangeDropsUnknownDistancesIfAsked) {
  Robot lost(1, NodeConfig{});
  Robot hearer(2, at(0, 0, 0));
  hearer.station.set_virtual_range({1.0, true});
  lost.publish("x");
  lost.transmit_to(hearer);
  EXPECT_TRUE(hearer.client.heard.empty());
  EXPECT_EQ(counter(hearer.station, "packets_unknown_distance"), 1u);
  hearer.station.set_virtual_range({});
  lost.publish("y");
  lost.transmit_to(hearer);
  EXPECT_EQ(hearer.client.heard.size(), 1u) << "without a range every packet is heard";
}

TEST(NodeStation, RobotsHeardAreNeighboursBeyondTheVirtualRangeToo) {
  Robot a(1, at(0, 0, 0));
  Robot b(2, at(3, 4, 0));
  b.station.set_virtual_range({1.0, false});
  b.link->user().on_frame(a.frame());
  const auto list = b.station.neighbours(std::chrono::steady_clock::now());
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0].node, 1);
  EXPECT_NEAR(list[0].range.distance_m, 5.0, 1e-3);
  EXPECT_TRUE(list[0].is_out_of_range);
}

TEST(NodeStation, OwnFramesAreKnownByIdAndEpochAlsoUnderTheIdBefore) {
  Robot a(std::nullopt, NodeConfig{});
  frame::FrameHeader header = a.station.frame_header();
  EXPECT_TRUE(a.link->user().is_own_frame(header));
  a.identity.draw_again();
  EXPECT_TRUE(a.link->user().is_own_frame(header));
  ++header.epoch;
  EXPECT_FALSE(a.link->user().is_own_frame(header)) << "a namesake";
}

TEST(NodeStation, NamesakeThatOnlyBeaconsIsNoticed) {
  Robot a(7, NodeConfig{});
  Robot b(7, NodeConfig{});
  a.link->user().on_frame(b.frame());
  EXPECT_EQ(a.counters.duplicate_node_ids, 1u);
}

TEST(NodeStation, BeaconTellsOfMessagesThatHaveLeftWhole) {
  Robot a(1, NodeConfig{});
  std::array<frame::LastMessage, 8> last;
  a.publish("one");
  EXPECT_EQ(a.link->user().last_messages(last), 0u) << "it has not left";
  a.link->pull_all();
  a.publish("two");
  ASSERT_EQ(a.link->user().last_messages(last), 1u);
  EXPECT_EQ(last[0].number, 1u);
}

TEST(NodeStation, LastMessageThatIsLostIsFoundByABeacon) {
  Robot a(1, NodeConfig{});
  Robot b(2, NodeConfig{});
  a.publish("heard");
  a.transmit_to(b);
  a.publish("lost");
  a.link->pull_all();
  EXPECT_EQ(b.counters.messages_lost_air, 0u);
  std::array<frame::LastMessage, 8> last;
  ASSERT_EQ(a.link->user().last_messages(last), 1u);
  b.link->user().on_last_message(last[0], a.frame());
  EXPECT_EQ(b.counters.messages_lost_air, 1u);
  EXPECT_EQ(b.subscription.lost.air, 1u);
  a.publish("heard");
  a.transmit_to(b);
  EXPECT_EQ(b.client.heard.size(), 2u);
  EXPECT_EQ(b.counters.messages_lost_air, 1u) << "counted once";
}

TEST(NodeStation, BeaconsTellOfManyChannelsInTurn) {
  Robot a(1, NodeConfig{});
  std::vector<Publisher> publishers(5);
  for (std::size_t i = 0; i < publishers.size(); ++i) {
    publishers[i].client = &a.client;
    ASSERT_FALSE(a.hub.advertise({"", static_cast<std::uint32_t>(i), std::nullopt}, publishers[i]));
    std::string payload = "x";
    ASSERT_FALSE(a.hub.publish(publishers[i], 1, payload, 0));
    a.link->pull_all();
  }
  std::set<std::uint16_t> told;
  std::array<frame::LastMessage, 2> last;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(a.link->user().last_messages(last), 2u);
    for (const frame::LastMessage& each : last) told.insert(each.channel);
  }
  EXPECT_EQ(told, (std::set<std::uint16_t>{0, 1, 2, 3, 4}));
}

TEST(NodeStation, LongestMessageCrossesWhole) {
  Robot a(1, NodeConfig{});
  Robot b(2, NodeConfig{});
  std::string longest(a.station.limits().max_message_bytes, '\0');
  for (std::size_t i = 0; i < longest.size(); ++i) longest[i] = static_cast<char>(i * 7 + i / 251);
  ASSERT_TRUE(a.publish(longest));
  a.transmit_to(b);
  ASSERT_EQ(b.client.heard.size(), 1u);
  EXPECT_EQ(b.client.last->payload, longest);
}

TEST(NodeStation, NumbersCountUpAndDuplicatesAreDropped) {
  Robot a(1, NodeConfig{});
  Robot b(2, NodeConfig{});
  for (std::uint32_t i = 1; i <= 3; ++i) {
    a.publish("x");
    const auto packets = a.link->pull_all();
    for (const auto& packet : packets) {
      b.link->hand_up(packet, a.frame());
      b.link->hand_up(packet, a.frame());
    }
    EXPECT_EQ(b.client.last->number, i);
  }
  EXPECT_EQ(b.client.heard.size(), 3u);
}

TEST(NodeStation, MessageIsForwardedWithItsHops) {
  Robot a(1, at(0, 0, 0));
  Robot b(2, at(1, 0, 0));
  Robot c(3, at(3, 0, 0));
  a.publish("x", 2);
  a.transmit_to(b);
  b.transmit_to(c);
  ASSERT_EQ(c.client.heard.size(), 1u);
  EXPECT_EQ(c.client.last->sender, 1);
  EXPECT_EQ(c.client.last->hops, 1);
  EXPECT_EQ(c.client.last->ttl, 1);
  EXPECT_NEAR(c.client.last->distance_m, 2.0, 1e-3);  // to the forwarder
  b.transmit_to(a);
  EXPECT_TRUE(a.client.heard.empty());  // its own message come back
}

TEST(NodeStation, TimestampedMessageTellsItsDelay) {
  Robot a(1, NodeConfig{}, true);
  Robot b(2, NodeConfig{}, true);
  a.publish("x");
  a.transmit_to(b);
  ASSERT_EQ(b.client.heard.size(), 1u);
  ASSERT_TRUE(b.client.last->buffering_delay_us);
  EXPECT_LT(*b.client.last->buffering_delay_us, 1'000'000u);
}

TEST(NodeStation, CancelledMessageNeverLeavesAndTheChannelGoesOn) {
  Robot a(1, NodeConfig{});
  Robot b(2, NodeConfig{});
  a.publish("stale");
  a.link->up = false;
  a.hub.give_up_on_dead_links();
  a.link->up = true;
  EXPECT_EQ(a.client.unsent.size(), 1u);
  ASSERT_TRUE(a.publish("fresh"));
  a.transmit_to(b);
  ASSERT_EQ(b.client.heard.size(), 1u);
  EXPECT_EQ(b.client.last->payload, "fresh");
  EXPECT_EQ(b.client.last->number, 1u);  // of the one given up nobody has heard
  b.publish("back");
  b.transmit_to(a);
  EXPECT_EQ(a.client.heard.size(), 1u);  // still listening after the cancellation
}

TEST(NodeStation, AutomaticIdChangesWhenSomebodyElseHasIt) {
  Robot a(std::nullopt, NodeConfig{});
  Robot b(a.identity.id(), NodeConfig{});
  b.publish("x");
  b.transmit_to(a);
  EXPECT_NE(a.identity.id(), b.identity.id());
  EXPECT_EQ(a.counters.node_id_changes, 1u);
  EXPECT_EQ(a.client.heard.size(), 1u);
  EXPECT_EQ(a.station.frame_header().node, a.identity.id());
}

TEST(NodeStation, FixedIdStaysAndTheDuplicateIsCounted) {
  Robot a(7, NodeConfig{});
  Robot b(7, NodeConfig{});
  b.publish("x");
  b.transmit_to(a);
  EXPECT_EQ(a.identity.id(), 7);
  EXPECT_EQ(a.counters.duplicate_node_ids, 1u);
  EXPECT_EQ(a.client.heard.size(), 1u);
}

TEST(NodeStation, NobodyListensNothingIsHandedUp) {
  Robot a(1, NodeConfig{});
  Robot b(2, NodeConfig{});
  b.hub.unsubscribe(b.subscription);
  a.publish("x");
  a.transmit_to(b);
  EXPECT_TRUE(b.client.heard.empty());
  EXPECT_EQ(b.counters.messages_received, 0u);
}

}  // namespace
}  // namespace swarmtalk::daemon
