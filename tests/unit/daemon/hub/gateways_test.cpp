// The rules alone, above a registry and an outbox.
#include "daemon/hub/gateways.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class NobodyListens final : public OutgoingListener {
 public:
  void on_outgoing(const Publication&, std::size_t, Channel&, std::uint32_t) override {}
  void on_stayed_here(const Publication&, Channel&) override {}
};

class GatewaysAlone : public testing::Test {
 protected:
  GatewaysAlone() {
    a_.station_limits.marks_gateways = b_.station_limits.marks_gateways = true;
    stations_.add(a_);
    stations_.add(b_);
    GatewayRule rule;
    rule.from_link = 0;
    rule.from_channel = 1;
    rule.to_link = 1;
    rule.to_channel = 2;
    EXPECT_FALSE(gateways_.set_rules({rule}));
  }
  static MessageHead head(std::uint16_t channel) {
    MessageHead head;
    head.channel = channel;
    head.sender = 9;
    head.number = 4;
    head.ttl = 2;
    return head;
  }

  const std::vector<std::uint8_t> payload_{'x'};
  DeafUser user_;
  FakeStation a_{user_, "a", 5};
  FakeStation b_{user_, "b", 6};
  StationList stations_;
  ChannelTable names_{{}};
  ChannelRegistry registry_{names_, stations_};
  DaemonCounters counters_;
  NobodyListens listener_;
  Outbox outbox_{stations_, registry_, counters_, listener_};
  NodeIdentity identity_{5};
  Gateways gateways_{stations_, registry_, outbox_, identity_, counters_};
};

TEST_F(GatewaysAlone, ListenWhereARuleBegins) {
  EXPECT_EQ(a_.listening, std::set<std::uint16_t>{1});
  EXPECT_TRUE(b_.listening.empty());
}

TEST_F(GatewaysAlone, CopyAMessageWithWhereItCameFrom) {
  gateways_.cross(0, head(1), payload_);
  ASSERT_EQ(b_.sent.size(), 1u);
  EXPECT_EQ(b_.sent[0].channel, 2);
  ASSERT_TRUE(b_.origins[0]);
  EXPECT_EQ(b_.origins[0]->link, "a");
  EXPECT_EQ(b_.origins[0]->node, 9);
  EXPECT_TRUE(a_.sent.empty());
}

TEST_F(GatewaysAlone, CopyNothingThatHasCrossedOrCameElsewhere) {
  MessageHead crossed = head(1);
  crossed.crossed_gateway = true;
  gateways_.cross(0, crossed, payload_);
  gateways_.cross(1, head(1), payload_);
  gateways_.cross(0, head(2), payload_);
  EXPECT_TRUE(b_.sent.empty());
  EXPECT_EQ(counters_.gateway_crossed, 1u);
}

TEST_F(GatewaysAlone, KnowAMessageThatComesByASecondWay) {
  EXPECT_FALSE(gateways_.came_otherwise(0, head(1), payload_));
  EXPECT_FALSE(gateways_.came_otherwise(0, head(1), payload_));
  EXPECT_TRUE(gateways_.came_otherwise(1, head(1), payload_));
  EXPECT_EQ(counters_.link_duplicates, 1u);
}

TEST_F(GatewaysAlone, CountWhatTheOtherLinkCannotTake) {
  b_.set_up(false);
  gateways_.cross(0, head(1), payload_);
  EXPECT_EQ(counters_.gateway_link_down, 1u);
}

TEST_F(GatewaysAlone, CopyOurOwnMessageOnceToEachTarget) {
  FakeStation c(user_, "c", 7);
  stations_.add(c);
  GatewayRule from_a, from_b, other;
  from_a.from_link = 0;
  from_b.from_link = 1;
  from_a.to_link = from_b.to_link = 2;
  from_a.from_channel = from_b.from_channel = 1;
  from_a.to_channel = from_b.to_channel = 2;
  other = from_b;
  other.to_channel = 3;
  DaemonCounters counters;
  ChannelRegistry registry(names_, stations_);
  Outbox outbox(stations_, registry, counters, listener_);
  Gateways gateways(stations_, registry, outbox, identity_, counters);
  ASSERT_FALSE(gateways.set_rules({from_a, from_b, other}));
  Publication own;
  own.payload = "x";
  own.ttl = 4;
  gateways.cross_own(own, *registry.find(1), 12);
  EXPECT_EQ(c.sent, (std::vector<FakeStation::Sent>{{2, "x", 4}, {3, "x", 4}}));
  ASSERT_EQ(c.origins.size(), 2u);
  EXPECT_EQ(c.origins[0]->link, "a");
  EXPECT_EQ(c.origins[0]->node, 5);
  EXPECT_EQ(c.origins[0]->number, 12u);
  EXPECT_EQ(c.origins[0]->epoch, identity_.epoch() & 0xFFFF);
  EXPECT_EQ(c.origins[1]->link, "b");
  EXPECT_EQ(c.origins[1]->node, 6);
  EXPECT_EQ(counters.gateway_there, 0u);
}

TEST_F(GatewaysAlone, ACopyHasTheRulesTtlOrTheMessagesAtMostWhatTheLinkHas) {
  const auto copied = [&](std::optional<std::uint8_t> rules, std::uint8_t messages,
                          std::uint32_t number) {
    GatewayRule rule;
    rule.from_link = 0;
    rule.from_channel = 1;
    rule.to_link = 1;
    rule.to_channel = 2;
    rule.ttl = rules;
    EXPECT_FALSE(gateways_.set_rules({rule}));
    MessageHead from = head(1);
    from.ttl = messages;
    from.number = number;
    gateways_.cross(0, from, payload_);
    const int ttl = b_.sent.back().ttl;
    b_.busy.clear();
    outbox_.on_sent(1, 2);
    return ttl;
  };
  b_.station_limits.max_ttl = 7;
  EXPECT_EQ(copied(std::nullopt, 6, 1), 6);
  EXPECT_EQ(copied(std::nullopt, 8, 2), 7);
  EXPECT_EQ(copied(3, 6, 3), 3);
  EXPECT_EQ(copied(9, 1, 4), 7);
}

TEST_F(GatewaysAlone, CountWhatIsTooShortOrTooLongForTheOtherLink) {
  b_.station_limits.min_message_bytes = 2;
  gateways_.cross(0, head(1), payload_);
  EXPECT_EQ(counters_.gateway_empty, 1u);
  b_.station_limits.min_message_bytes = 1;
  b_.fits = 5;  // with where it came from, it is longer
  MessageHead next = head(1);
  next.number = 5;
  gateways_.cross(0, next, payload_);
  EXPECT_EQ(counters_.gateway_too_long, 1u);
  EXPECT_EQ(counters_.gateway_empty, 1u);
  EXPECT_TRUE(b_.sent.empty());
}

}  // namespace
}  // namespace swarmtalk::daemon
