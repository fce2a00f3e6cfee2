// The hub with several links.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/hub/hub.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;

class HubWithTwoStations : public testing::Test {
 protected:
  HubWithTwoStations() {
    hub_.add(wifi_);
    hub_.add(wire_);
  }

  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{std::nullopt};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation wifi_{hub_, "wifi"};
  FakeStation wire_{hub_, "wire"};
};

TEST_F(HubWithTwoStations, SendsOnEveryLinkThatIsUpAndWaitsForAll) {
  wifi_.identity_in_use = wire_.identity_in_use = &identity_;
  FakeClient client, listener;
  Publisher from;
  from.client = &client;
  Subscription to;
  to.client = &listener;
  ASSERT_FALSE(hub_.advertise({"", 1u, std::nullopt}, from));
  ASSERT_FALSE(hub_.subscribe({"", 1u, std::nullopt}, to));
  std::string payload = "x";
  ASSERT_FALSE(hub_.publish(from, 1, payload, std::nullopt));
  EXPECT_EQ(listener.heard.size(), 1u);  // locally once, not once for each link
  wifi_.leave(1);
  EXPECT_TRUE(client.sent.empty());
  wire_.set_up(false);
  hub_.give_up_on_dead_links();
  EXPECT_THAT(client.sent, ElementsAre(1u));  // one link took it
  payload = "y";
  ASSERT_FALSE(hub_.publish(from, 2, payload, std::nullopt));
  EXPECT_EQ(wire_.sent.size(), 1u);
  wifi_.leave(1);
  EXPECT_THAT(client.sent, ElementsAre(1u, 2u));
  // An automatic id changes, on both alike.
  const auto old = identity_.id();
  hub_.on_namesake(wifi_);
  EXPECT_NE(identity_.id(), old);
  EXPECT_EQ(wire_.node_id, identity_.id());
}

TEST_F(HubWithTwoStations, LinkThatMissedMessagesGoesOnUnderTheNumbersOfTheOther) {
  FakeClient client;
  Publisher from;
  from.client = &client;
  ASSERT_FALSE(hub_.advertise({"", 1u, std::nullopt}, from));
  const auto publish = [&](bool is_on_wire) {
    std::string payload = "x";
    ASSERT_FALSE(hub_.publish(from, 1, payload, std::nullopt));
    wifi_.leave(1);
    if (is_on_wire) wire_.leave(1);
  };
  publish(true);
  wire_.set_up(false);
  publish(false);
  publish(false);
  wire_.set_up(true);
  publish(true);
  EXPECT_EQ(wire_.sent.size(), 2u);
  EXPECT_EQ(wifi_.last_number, 4u);
  EXPECT_EQ(wire_.last_number, 4u);
  wire_.last_number = 9;  // ahead, as from a run of the channel before
  publish(true);
  publish(true);
  EXPECT_EQ(wifi_.last_number, 11u);
  EXPECT_EQ(wire_.last_number, 11u);
}

TEST_F(HubWithTwoStations, MessageIsLostThatNoLinkBrings) {
  FakeClient client;
  Subscription to;
  to.client = &client;
  ASSERT_FALSE(hub_.subscribe({"", 1u, std::nullopt}, to));
  const auto hear = [&](Station& station, std::uint32_t number, std::uint64_t kernel_drops = 0) {
    MessageHead head;
    head.channel = 1;
    head.sender = 9;
    head.epoch = 3;
    head.number = number;
    head.has_wide_number = true;
    head.drops.kernel = kernel_drops;
    hub_.on_message(station, head, {});
  };
  hear(wifi_, 1);
  hear(wire_, 1);
  hear(wire_, 2);  // not over Wi-Fi
  hear(wifi_, 3);
  EXPECT_EQ(counters_.messages_lost_air, 0u);
  hear(wifi_, 6, 1);  // 4 and 5 over neither; of the two a socket's buffer had no room for one
  EXPECT_EQ(counters_.messages_lost_kernel, 1u);
  EXPECT_EQ(counters_.messages_lost_air, 1u);
  hear(wire_, 5);
  EXPECT_EQ(counters_.messages_late, 1u);
  hear(wire_, 9, 7);  // drops of both count
  EXPECT_EQ(counters_.messages_lost_kernel, 3u);
  EXPECT_EQ(counters_.messages_lost_air, 1u);
  EXPECT_EQ(counters_.messages_received, 6u);
}

TEST(HubWithLinks, IdOfALinkOfItsOwnChangesAlone) {
  ChannelTable names({});
  LimitsConfig limits;
  DaemonCounters counters;
  NodeIdentity identity(5);
  NodeIdentity own(std::nullopt, {248, 254}, identity.epoch());
  Hub hub(names, limits, counters, identity);
  FakeStation wifi(hub, "wifi");
  FakeStation small(hub, "small");
  small.identity_in_use = &own;
  hub.add(wifi);
  hub.add(small);
  const auto old = own.id();
  hub.on_namesake(small);
  EXPECT_NE(own.id(), old);
  EXPECT_GE(own.id(), 248);
  EXPECT_EQ(small.node_id, own.id());
  EXPECT_EQ(wifi.node_id, 0) << "untouched";
}

}  // namespace
}  // namespace swarmtalk::daemon
