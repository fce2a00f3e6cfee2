// One client's subscriptions and publishers, above a hub, without a socket.
#include "daemon/session/client_channels.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "tests/unit/daemon/session/client_parts.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

class Channels : public testing::Test {
 protected:
  Channels() { hub_.add(station_); }
  ~Channels() override { channels_.leave(); }

  void subscribe() {
    ipc::Subscribe request;
    request.mutable_channel()->set_number(1);
    channels_.subscribe(request);
  }
  void advertise() {
    ipc::Advertise request;
    request.mutable_channel()->set_number(1);
    channels_.advertise(request);
  }

  ClientParts parts_;
  ChannelTable names_{{}};
  NodeIdentity identity_{5};
  Hub hub_{names_, parts_.limits, parts_.counters, identity_};
  FakeStation station_{hub_};
  ClientChannels channels_{hub_, parts_.limits, parts_.counters, parts_.output, parts_.answers};
};

TEST_F(Channels, AnswerASubscriptionAndQueueWhatItHears) {
  subscribe();
  EXPECT_TRUE(parts_.told().at(0).has_subscribed());
  MessageHead head;
  head.channel = 1;
  station_.receive(head, "x");
  const auto told = parts_.told();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].deliver().payload(), "x");
}

TEST_F(Channels, SayWhetherMessagesHaveTheRedundancyThatWasAskedFor) {
  std::uint32_t channel = 0;
  const auto ask = [&](std::uint32_t repairs, bool is_auto) {
    ipc::Advertise request;
    request.mutable_channel()->set_number(++channel);
    if (repairs != 0) request.set_redundancy(repairs);
    if (is_auto) request.set_auto_redundancy(true);
    channels_.advertise(request);
    return parts_.told().at(0);
  };
  EXPECT_FALSE(ask(3, false).advertised().has_redundancy()) << "this link has none";
  station_.repairs = true;
  EXPECT_FALSE(ask(0, false).advertised().has_redundancy()) << "nobody asked";
  EXPECT_TRUE(ask(3, false).advertised().has_redundancy());
  EXPECT_TRUE(ask(0, true).advertised().has_redundancy());
  const ipc::Failure refused = ask(13, false).failure();
  EXPECT_EQ(refused.code(), ipc::ERROR_LIMIT);
  EXPECT_EQ(refused.limit(), 12u);
}

TEST_F(Channels, TellWhatBecameOfAMessage) {
  advertise();
  const std::uint32_t id = parts_.told().at(0).advertised().publisher_id();
  channels_.publish({id, 9, "x", {}, {}});
  EXPECT_TRUE(parts_.told().empty());
  station_.leave(1);
  EXPECT_EQ(parts_.told().at(0).sent().publish_number(), 9u);
  channels_.publish({id + 1, 10, "x", {}, {}});
  EXPECT_EQ(parts_.told().at(0).failure().code(), ipc::ERROR_UNKNOWN_ID);
}

TEST_F(Channels, EndASubscriptionAndAPublisherOnce) {
  subscribe();
  advertise();
  const auto made = parts_.told();
  ASSERT_EQ(made.size(), 2u);
  const std::uint32_t subscription = made[0].subscribed().subscription_id();
  const std::uint32_t publisher = made[1].advertised().publisher_id();
  for (const bool is_first : {true, false}) {
    channels_.unsubscribe(subscription);
    channels_.unadvertise(publisher);
    const auto told = parts_.told();
    ASSERT_EQ(told.size(), 2u);
    for (const ipc::Envelope& each : told) {
      EXPECT_EQ(each.has_done(), is_first);
      if (!is_first) {
        EXPECT_EQ(each.failure().code(), ipc::ERROR_UNKNOWN_ID);
      }
    }
    if (is_first) continue;
    EXPECT_EQ(told[0].failure().text(),
              "this connection has no subscription " + std::to_string(subscription));
    EXPECT_EQ(told[1].failure().text(),
              "this connection has no publisher " + std::to_string(publisher));
  }
  EXPECT_TRUE(hub_.channels().empty());
}

TEST_F(Channels, RefuseWhatIsNotWithinTheLimitsOfAPublisher) {
  parts_.limits.publish_queue_max = 4;
  parts_.limits.copies_max = 3;
  const auto ask = [&](const std::function<void(ipc::Advertise&)>& change) {
    ipc::Advertise request;
    request.mutable_channel()->set_number(1);
    change(request);
    channels_.advertise(request);
    const ipc::Failure refused = parts_.told().at(0).failure();
    return std::pair(refused.code(), refused.limit());
  };
  const std::pair<ipc::ErrorCode, std::uint64_t> taken(ipc::ERROR_UNSPECIFIED, 0);
  const auto limit = [](std::uint64_t most) { return std::pair(ipc::ERROR_LIMIT, most); };
  EXPECT_EQ(ask([](auto& to) { to.set_queue(4); }), taken);
  EXPECT_EQ(ask([](auto& to) { to.set_queue(5); }), limit(4));
  EXPECT_EQ(ask([](auto& to) { to.set_copies(3); }), taken);
  EXPECT_EQ(ask([](auto& to) { to.set_copies(4); }), limit(3));
  EXPECT_EQ(ask([](auto& to) { to.set_copies(0); }), limit(3));
  EXPECT_EQ(ask([](auto& to) { to.set_copy_interval_ms(10'000); }), taken);
  EXPECT_EQ(ask([](auto& to) { to.set_copy_interval_ms(10'001); }), limit(10'000));
  EXPECT_EQ(ask([](auto& to) { to.set_copy_interval_ms(0); }), limit(10'000));
  ipc::ClientStatus status;
  channels_.fill(status);
  EXPECT_EQ(status.publishers(), 3u);
}

TEST_F(Channels, LeaveTheHubWithAllTheyHold) {
  subscribe();
  advertise();
  channels_.leave();
  EXPECT_TRUE(hub_.channels().empty());
  ipc::ClientStatus status;
  channels_.fill(status);
  EXPECT_EQ(status.subscriptions() + status.publishers(), 0u);
}

}  // namespace
}  // namespace swarmtalk::daemon
