// Publishers' queues and copies: what becomes of messages that come faster than they leave.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/common/monotonic_ns.hpp"
#include "daemon/hub/hub.hpp"
#include "tests/unit/daemon/station/fake_station.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;
using testing::Pair;

class HubQueueTest : public testing::Test {
 protected:
  HubQueueTest() {
    hub_.add(station_);
    hub_.set_copy_hook([this](Hub::Time at) { copy_at_ = at; });
    publisher_.client = &client_;
    publisher_.id = 1;
    EXPECT_FALSE(hub_.advertise({"", 1, std::nullopt}, publisher_));
  }
  /// @return what a timestamped channel's station is told of the wait, in us
  std::uint64_t waited_us(std::uint64_t sent_at_ns) {
    Publisher publisher;
    publisher.client = &client_;
    EXPECT_FALSE(hub_.advertise({"", 2, true}, publisher));
    std::string payload = "x";
    EXPECT_FALSE(hub_.publish(publisher, 1, payload, std::nullopt, sent_at_ns));
    hub_.unadvertise(publisher);
    return station_.last_waited_us;
  }
  ipc::ErrorCode publish(std::uint64_t number) {
    std::string payload = std::to_string(number);
    const auto refusal = hub_.publish(publisher_, number, payload, std::nullopt);
    return refusal ? refusal->code : ipc::ERROR_UNSPECIFIED;
  }
  std::vector<std::string> sent() const {
    std::vector<std::string> payloads;
    for (const auto& each : station_.sent) payloads.push_back(each.payload);
    return payloads;
  }

  ChannelTable names_{{{"hello", 1}}};
  LimitsConfig limits_;
  DaemonCounters counters_;
  NodeIdentity identity_{5};
  Hub hub_{names_, limits_, counters_, identity_};
  FakeStation station_{hub_};
  FakeClient client_;
  Publisher publisher_;
  std::optional<Hub::Time> copy_at_;
};

TEST_F(HubQueueTest, MessagesWaitInOrderBehindTheOneInFlight) {
  publisher_.queue_limit = 2;
  for (std::uint64_t i = 1; i <= 3; ++i) EXPECT_EQ(publish(i), ipc::ERROR_UNSPECIFIED);
  EXPECT_EQ(publish(4), ipc::ERROR_BUSY);
  for (int i = 0; i < 3; ++i) station_.leave(1);
  EXPECT_THAT(sent(), ElementsAre("1", "2", "3"));
  EXPECT_THAT(client_.sent, ElementsAre(1u, 2u, 3u));
  EXPECT_EQ(publish(5), ipc::ERROR_UNSPECIFIED);
}

TEST_F(HubQueueTest, DropsTheOldestThatWaitsIfAskedAndTellsIt) {
  publisher_.queue_limit = 2;
  publisher_.drops_oldest = true;
  for (std::uint64_t i = 1; i <= 5; ++i) EXPECT_EQ(publish(i), ipc::ERROR_UNSPECIFIED);
  EXPECT_THAT(client_.unsent,
              ElementsAre(Pair(2u, ipc::ERROR_DROPPED), Pair(3u, ipc::ERROR_DROPPED)));
  for (int i = 0; i < 3; ++i) station_.leave(1);
  EXPECT_THAT(sent(), ElementsAre("1", "4", "5"));
  EXPECT_EQ(counters_.messages_published, 5u);
  EXPECT_EQ(counters_.messages_sent + counters_.messages_dropped_queue, 5u);
}

TEST_F(HubQueueTest, ALinkThatGoesDownEndsAllThatWait) {
  publisher_.queue_limit = 3;
  for (std::uint64_t i = 1; i <= 4; ++i) publish(i);
  station_.set_up(false);
  EXPECT_FALSE(hub_.give_up_on_dead_links());
  EXPECT_EQ(client_.unsent.size(), 4u);
  EXPECT_EQ(counters_.messages_link_down, 4u);
  station_.set_up(true);
  EXPECT_EQ(publish(5), ipc::ERROR_UNSPECIFIED);
  EXPECT_EQ(sent().back(), "5");
}

TEST_F(HubQueueTest, WhatWaitsForAPublisherThatLeavesIsSentAllTheSame) {
  publisher_.queue_limit = 3;
  for (std::uint64_t i = 1; i <= 4; ++i) publish(i);
  hub_.unadvertise(publisher_);
  for (int i = 0; i < 4; ++i) station_.leave(1);
  EXPECT_THAT(sent(), ElementsAre("1", "2", "3", "4"));
  EXPECT_TRUE(client_.sent.empty());
  EXPECT_EQ(counters_.messages_sent, 4u);
}

TEST_F(HubQueueTest, TheTimeInTheQueueCountsInTheDelay) {
  const std::uint64_t sent_at_ns = monotonic_ns() - 5'000'000;
  const std::uint64_t waited = waited_us(sent_at_ns);
  EXPECT_GE(waited, 5000u);
  EXPECT_LE(waited, (monotonic_ns() - sent_at_ns) / 1000);
}

TEST_F(HubQueueTest, ATimeInTheFutureIsNow) {
  EXPECT_EQ(waited_us(UINT64_MAX), 0u);
}

TEST_F(HubQueueTest, CopiesFollowAtTheirTimeAndSentComesAfterTheLast) {
  publisher_.copies = 3;
  publisher_.copy_interval_ms = 20;
  publish(1);
  for (int copy = 1; copy < 3; ++copy) {
    copy_at_.reset();
    station_.leave(1);
    ASSERT_TRUE(copy_at_);
    EXPECT_TRUE(client_.sent.empty());
    hub_.send_copies(*copy_at_ - std::chrono::milliseconds(1));
    EXPECT_EQ(sent().size(), static_cast<std::size_t>(copy));
    hub_.send_copies(*copy_at_);
    EXPECT_EQ(sent().size(), static_cast<std::size_t>(copy + 1));
  }
  station_.leave(1);
  EXPECT_THAT(client_.sent, ElementsAre(1u));
  EXPECT_THAT(sent(), ElementsAre("1", "1", "1"));
  EXPECT_EQ(counters_.copies_sent, 2u);
}

TEST_F(HubQueueTest, CopiesFollowWhenTheLastSubscriberLeavesBetweenThem) {
  publisher_.copies = 3;
  publisher_.copy_interval_ms = 20;
  Subscription subscription;
  subscription.client = &client_;
  ASSERT_FALSE(hub_.subscribe({"", 1, std::nullopt}, subscription));
  publish(1);
  station_.leave(1);
  hub_.unsubscribe(subscription);
  for (int copy = 1; copy < 3; ++copy) {
    hub_.send_copies(*copy_at_);
    EXPECT_EQ(station_.listening.count(1), 1u) << "its node would forget the message";
    station_.leave(1);
  }
  EXPECT_THAT(sent(), ElementsAre("1", "1", "1"));
  EXPECT_THAT(client_.sent, ElementsAre(1u));
  EXPECT_EQ(station_.listening.count(1), 0u) << "and after the last copy it does not listen";
}

TEST_F(HubQueueTest, ANodeCeasesToListenWhenCopiesAreGivenUp) {
  publisher_.copies = 2;
  publisher_.copy_interval_ms = 20;
  Subscription subscription;
  subscription.client = &client_;
  ASSERT_FALSE(hub_.subscribe({"", 1, std::nullopt}, subscription));
  publish(1);
  station_.leave(1);
  hub_.unsubscribe(subscription);
  EXPECT_EQ(station_.listening.count(1), 1u);
  station_.set_up(false);
  hub_.give_up_on_dead_links();
  EXPECT_EQ(station_.listening.count(1), 0u);
}

TEST_F(HubQueueTest, AMessageOfWhichACopyHasLeftWasSentWhenTheLinkGoesDown) {
  publisher_.copies = 2;
  publisher_.copy_interval_ms = 20;
  publish(1);
  station_.leave(1);
  station_.set_up(false);
  hub_.give_up_on_dead_links();
  EXPECT_THAT(client_.sent, ElementsAre(1u));
  hub_.send_copies(*copy_at_);  // there is none any more
  EXPECT_EQ(sent().size(), 1u);
}

TEST_F(HubQueueTest, ACopyThatWasGivenUpDoesNotSendTheNextMessageEarly) {
  publisher_.copies = 2;
  publisher_.copy_interval_ms = 20;
  publish(1);
  station_.leave(1);
  const auto given_up_at = copy_at_;
  station_.set_up(false);
  hub_.give_up_on_dead_links();
  station_.set_up(true);
  publisher_.copy_interval_ms = 1000;
  publish(2);
  station_.leave(1);
  hub_.send_copies(*given_up_at);
  EXPECT_THAT(sent(), ElementsAre("1", "2"));
  ASSERT_GT(*copy_at_, *given_up_at) << "the copy that is to come is told";
  hub_.send_copies(*copy_at_);
  EXPECT_THAT(sent(), ElementsAre("1", "2", "2"));
}

TEST_F(HubQueueTest, AMessageWhoseCopyItsNodeRefusesWasSent) {
  publisher_.copies = 3;
  publisher_.copy_interval_ms = 20;
  publish(1);
  station_.leave(1);
  station_.kept.clear();  // its node has forgotten the message
  hub_.send_copies(*copy_at_);
  EXPECT_THAT(client_.sent, ElementsAre(1u));
  publish(2);
  EXPECT_THAT(sent(), ElementsAre("1", "2"));
}

}  // namespace
}  // namespace swarmtalk::daemon
