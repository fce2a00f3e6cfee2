// The rules alone, above a registry and an outbox.
#include "daemon/hub/gateways.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class NobodyListens final : public OutgoingListener {
 public:
  void on_outgoing(const Publication&, std::size_t, Channel&, std::uint32_t) override {}
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

}  // namespace
}  // namespace swarmtalk::daemon
