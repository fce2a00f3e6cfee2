// Gateway rules between two stations that a test plays by hand: what crosses, as what, and what
// does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/hub/hub.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::size_t kWifi = 0;
constexpr std::size_t kSmall = 1;

class HubGatewayTest : public testing::Test {
 protected:
  HubGatewayTest() {
    small_.station_limits = profile_entry(frame::ProfileId::kKilobot).limits;
    small_.fits = 40;
    hub_.add(wifi_);
    hub_.add(small_);
  }

  void join(std::uint16_t wifi_channel, std::uint16_t small_channel, bool both_ways = true) {
    std::vector<GatewayRule> rules{{kWifi, wifi_channel, kSmall, small_channel, std::nullopt, 2}};
    if (both_ways) {
      rules.push_back({kSmall, small_channel, kWifi, wifi_channel, std::nullopt, 2});
    }
    const auto refusal = hub_.set_gateways(rules);
    EXPECT_FALSE(refusal) << refusal->text;
  }
  static MessageHead head(std::uint16_t channel, std::uint16_t sender, std::uint32_t number = 1,
                          std::uint32_t epoch = 77) {
    MessageHead head;
    head.channel = channel;
    head.sender = sender;
    head.number = number;
    head.epoch = epoch;
    return head;
  }
  Subscription& subscription(std::uint16_t channel) {
    auto& made = *subscriptions_.emplace_back(std::make_unique<Subscription>());
    made.client = &client_;
    made.id = channel;
    EXPECT_FALSE(hub_.subscribe({"", channel, std::nullopt}, made));
    return made;
  }

  ChannelTable names_{{}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation wifi_{hub_, "wifi", 5};
  FakeStation small_{hub_, "kilobots", 250};
  FakeClient client_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
};

TEST_F(HubGatewayTest, ListensForARuleWithoutAnySubscription) {
  join(1000, 3, false);
  EXPECT_EQ(wifi_.listening, std::set<std::uint16_t>{1000});
  EXPECT_THAT(small_.listening, IsEmpty());
  EXPECT_EQ(small_.open, std::set<std::uint16_t>{3});
}

TEST_F(HubGatewayTest, GoesOnListeningWhenTheLastSubscriptionLeaves) {
  join(1000, 3, false);
  hub_.unsubscribe(subscription(1000));
  EXPECT_EQ(wifi_.listening, std::set<std::uint16_t>{1000});
}

TEST_F(HubGatewayTest, MessageCrossesWithItsOrigin) {
  join(1000, 3);
  auto from_kilobot = head(3, 7, 9, 0);
  from_kilobot.ttl = 2;
  small_.receive(from_kilobot, "hot");
  EXPECT_THAT(wifi_.sent, ElementsAre(FakeStation::Sent{1000, "hot", 2}));
  EXPECT_EQ(wifi_.origins[0], (GatewayOrigin{"kilobots", 7, 0, 9}));
  wifi_.leave(1000);
  EXPECT_EQ(counters_.gateway_sent, 1u);
  EXPECT_EQ(counters_.messages_sent, 0u) << "not a client's";
}

TEST_F(HubGatewayTest, WhatHasCrossedAGatewayDoesNotCrossAnother) {
  join(1000, 3);
  auto crossed = head(1000, 6);
  crossed.crossed_gateway = true;
  crossed.origin = GatewayOrigin{"other", 8, 1, 1};
  wifi_.receive(crossed, "x");
  EXPECT_THAT(small_.sent, IsEmpty());
  EXPECT_EQ(counters_.gateway_crossed, 1u);
}

TEST_F(HubGatewayTest, SubscribersHearOriginAndMark) {
  auto crossed = head(1000, 6);
  crossed.crossed_gateway = true;
  crossed.origin = GatewayOrigin{"kilobots", 8, 0, 4};
  subscription(1000);
  wifi_.receive(crossed, "x");
  ASSERT_EQ(client_.heard.size(), 1u);
  EXPECT_TRUE(client_.last->crossed_gateway);
  EXPECT_EQ(client_.last->origin, crossed.origin);
  EXPECT_EQ(client_.last->sender, 6);
}

TEST_F(HubGatewayTest, TwoGatewaysCopiesAreHeardOnce) {
  subscription(1000);
  for (const std::uint16_t gateway : {std::uint16_t{6}, std::uint16_t{9}}) {
    auto crossed = head(1000, gateway, gateway);
    crossed.crossed_gateway = true;
    crossed.origin = GatewayOrigin{"kilobots", 8, 3, 4};
    wifi_.receive(crossed, "x");
  }
  EXPECT_EQ(client_.heard.size(), 1u);
  EXPECT_EQ(counters_.link_duplicates, 1u);
}

TEST_F(HubGatewayTest, DoesNotCopyWhatAnotherGatewayHasBroughtAlready) {
  join(1000, 3);
  auto crossed = head(1000, 6, 50);
  crossed.crossed_gateway = true;
  crossed.origin = GatewayOrigin{"kilobots", 7, 0, 9};
  wifi_.receive(crossed, "hot");
  small_.receive(head(3, 7, 9, 0), "hot");
  EXPECT_THAT(wifi_.sent, IsEmpty());
  EXPECT_EQ(counters_.gateway_there, 1u);
}

TEST_F(HubGatewayTest, LocalSubscribersOfTheOtherChannelHearTheCopy) {
  join(1000, 3);
  subscription(1000);
  small_.receive(head(3, 7), "hot");
  ASSERT_EQ(client_.heard.size(), 1u);
  EXPECT_EQ(client_.last->channel, 1000);
  EXPECT_EQ(client_.last->origin->link, "kilobots");
}

TEST_F(HubGatewayTest, SameChannelOnBothLinksIsHeardOnce) {
  join(3, 3);
  subscription(3);
  small_.receive(head(3, 7), "hot");
  EXPECT_EQ(client_.heard.size(), 1u);
  EXPECT_EQ(wifi_.sent.size(), 1u);
}

TEST_F(HubGatewayTest, ProgramsOfTheGatewayReachTheOtherLinkToo) {
  join(1000, 3);
  Publisher publisher;
  publisher.client = &client_;
  ASSERT_FALSE(hub_.advertise({"", 1000, std::nullopt}, publisher));
  std::string payload = "stop";
  ASSERT_FALSE(hub_.publish(publisher, 1, payload, std::nullopt));
  EXPECT_THAT(wifi_.sent, ElementsAre(FakeStation::Sent{1000, "stop", 0}));
  EXPECT_THAT(small_.sent, ElementsAre(FakeStation::Sent{3, "stop", 0}));
  wifi_.leave(1000);
  small_.leave(3);
  EXPECT_THAT(client_.sent, ElementsAre(1u)) << "once, for the publication itself";
}

TEST_F(HubGatewayTest, NewerCopiesReplaceTheOldestThatWait) {
  join(1000, 3);
  for (std::uint32_t i = 1; i <= 5; ++i) wifi_.receive(head(1000, 9, i), std::to_string(i));
  EXPECT_EQ(counters_.gateway_full, 2u);  // 1 in flight, 2 wait
  for (int i = 0; i < 3; ++i) small_.leave(3);
  EXPECT_THAT(small_.sent, ElementsAre(FakeStation::Sent{3, "1", 0}, FakeStation::Sent{3, "4", 0},
                                       FakeStation::Sent{3, "5", 0}));
  EXPECT_EQ(counters_.gateway_sent, 3u);
  EXPECT_EQ(counters_.gateway_link_down, 0u);
}

TEST_F(HubGatewayTest, WhatTheOtherLinkCannotCarryIsCountedByCause) {
  join(1000, 3);
  wifi_.receive(head(1000, 9, 1), std::string(41, 'x'));
  EXPECT_EQ(counters_.gateway_too_long, 1u);
  wifi_.receive(head(1000, 9, 2), "");
  EXPECT_EQ(counters_.gateway_empty, 1u);
  small_.set_up(false);
  wifi_.receive(head(1000, 9, 3), "x");
  EXPECT_EQ(counters_.gateway_link_down, 1u);
  EXPECT_THAT(small_.sent, IsEmpty());
}

TEST_F(HubGatewayTest, CopyGivenUpOnADeadLinkIsCounted) {
  join(1000, 3);
  wifi_.receive(head(1000, 9, 1), "x");
  small_.set_up(false);
  EXPECT_FALSE(hub_.give_up_on_dead_links());
  EXPECT_EQ(counters_.gateway_link_down, 1u);
  EXPECT_EQ(counters_.messages_link_down, 0u);
}

TEST_F(HubGatewayTest, TtlOfACopyFitsTheOtherLink) {
  join(1000, 3);
  auto far = head(1000, 9);
  far.ttl = 200;
  wifi_.receive(far, "x");
  EXPECT_THAT(small_.sent, ElementsAre(FakeStation::Sent{3, "x", 15}));
}

TEST_F(HubGatewayTest, MessageHeardOverTwoLinksIsHeardOnce) {
  subscription(3);
  wifi_.receive(head(3, 9, 4), "x");
  small_.receive(head(3, 9, 4), "x");
  EXPECT_EQ(client_.heard.size(), 1u);
  wifi_.receive(head(3, 9, 5), "x");
  EXPECT_EQ(client_.heard.size(), 2u);
}

TEST_F(HubGatewayTest, ChannelsBeyondTheSmallLinkGoOverTheOther) {
  Publisher publisher;
  publisher.client = &client_;
  ASSERT_FALSE(hub_.advertise({"", 40000, std::nullopt}, publisher));
  EXPECT_EQ(hub_.limits(40000).message_bytes, 1000);
  EXPECT_EQ(hub_.limits(3).message_bytes, 40) << "both links carry it";
  std::string payload(500, 'x');
  EXPECT_FALSE(hub_.publish(publisher, 1, payload, std::nullopt));
  EXPECT_THAT(small_.sent, IsEmpty());
  wifi_.set_up(false);
  payload = "x";
  const auto refusal = hub_.publish(publisher, 2, payload, std::nullopt);
  ASSERT_TRUE(refusal) << "the small link is up, but it has no such channel";
  EXPECT_EQ(refusal->code, ipc::ERROR_LINK_DOWN);
}

TEST_F(HubGatewayTest, ChannelsThatTheSmallLinkTimestampsAreSoByDefault) {
  Publisher nine;
  nine.client = &client_;
  ASSERT_FALSE(hub_.advertise({"", 9, std::nullopt}, nine));
  EXPECT_EQ(small_.open.count(9), 1u);
  EXPECT_TRUE(hub_.channels().at(0).is_timestamped);
}

TEST_F(HubGatewayTest, OtherTimestampingOfAPinnedChannelIsRefusedWithTheLink) {
  join(1000, 3);
  Subscription subscription;
  subscription.client = &client_;
  const auto refusal = hub_.subscribe({"", 3, true}, subscription);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, ipc::ERROR_CHANNEL_CONFLICT);
  EXPECT_THAT(refusal->text, HasSubstr("kilobots"));
  Subscription timed;
  timed.client = &client_;
  EXPECT_FALSE(hub_.subscribe({"", 1000, true}, timed)) << "Wi-Fi can do both";
  EXPECT_EQ(wifi_.listening.count(1000), 1u);
}

}  // namespace
}  // namespace swarmtalk::daemon
