// What a program is told, and in which order, without a connection.
#include "client_lib/deliveries.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <string>
#include <vector>

#include "loop/clock.hpp"
#include "tests/support/turned_clock.hpp"

namespace swarmtalk::client {
namespace {

class DeliveriesAlone : public testing::Test {
 protected:
  DeliveriesAlone() {
    subscriber_->receive = [this](const Message& message) {
      told_.push_back(message.payload);
      lost_.push_back(message.lost_before.client);
    };
    publisher_->sent = [this](const Status& status) {
      told_.push_back(status ? "sent" : "unsent");
    };
    deliveries_.callbacks().on_error = [this](const Status& status) {
      told_.push_back(std::string(status.text()));
    };
    deliveries_.callbacks().on_gap = {};
  }
  void deliver(const std::string& payload, bool may_call = false) {
    ipc::DeliverFrame frame;
    frame.payload = payload;
    deliveries_.deliver(subscriber_, frame, may_call);
  }

  Reports reports_;
  int wakes_ = 0;
  Deliveries deliveries_{reports_, [this] { ++wakes_; }};
  std::shared_ptr<SubscriberState> subscriber_ = std::make_shared<SubscriberState>();
  std::shared_ptr<PublisherState> publisher_ = std::make_shared<PublisherState>();
  std::vector<std::string> told_;
  std::vector<std::uint64_t> lost_;
};

TEST_F(DeliveriesAlone, TellAtOnceWhatMayBeToldAndHasNothingBeforeIt) {
  deliver("a", true);
  EXPECT_EQ(told_, std::vector<std::string>{"a"});
  EXPECT_EQ(wakes_, 0);
}

TEST_F(DeliveriesAlone, KeepTheOrderInWhichThingsHappened) {
  deliver("a");
  deliveries_.tell_sent(publisher_, Status(), true);
  deliver("b", true);
  EXPECT_TRUE(told_.empty());
  EXPECT_EQ(wakes_, 3);
  deliveries_.run();
  EXPECT_EQ(told_, (std::vector<std::string>{"a", "sent", "b"}));
}

TEST_F(DeliveriesAlone, DropByThePolicyAndTellWithTheNext) {
  subscriber_->policy.keep_last = 1;
  for (const char* payload : {"a", "b", "c"}) deliver(payload, true);
  EXPECT_TRUE(deliveries_.has_read_ahead());
  deliveries_.run();
  EXPECT_EQ(told_, std::vector<std::string>{"c"});
  EXPECT_EQ(lost_, std::vector<std::uint64_t>{2});
  EXPECT_FALSE(deliveries_.has_read_ahead());
  EXPECT_TRUE(deliveries_.take_has_loss());
  EXPECT_EQ(subscriber_->unreported_loss, 2u);
}

TEST_F(DeliveriesAlone, TellWhatOtherThreadsHadToReport) {
  reports_.add(Status(StatusCode::kBusy, "busy"));
  deliveries_.run();
  EXPECT_EQ(told_, std::vector<std::string>{"busy"});
  reports_.add(Status(StatusCode::kRate, "too fast"));
  deliveries_.run();
  deliveries_.run();
  EXPECT_EQ(told_, (std::vector<std::string>{"busy", "too fast"})) << "each once";
}

TEST_F(DeliveriesAlone, DropTheOldestMessageWhereThereIsNoRoomForMore) {
  subscriber_->policy.keep_last = 100'000;
  deliveries_.tell_sent(publisher_, Status(), false);
  constexpr int kMost = 4096;
  for (int i = 0; i < kMost + 4; ++i) deliver(std::to_string(i));
  deliveries_.run();
  ASSERT_EQ(told_.size(), static_cast<std::size_t>(kMost)) << "with what is no message";
  EXPECT_EQ(told_[0], "sent");
  EXPECT_EQ(told_[1], "5");
  EXPECT_EQ(told_.back(), std::to_string(kMost + 3));
  EXPECT_EQ(lost_[0], 5u);
  EXPECT_EQ(lost_[1], 0u);
  EXPECT_FALSE(deliveries_.has_read_ahead());
}

TEST_F(DeliveriesAlone, PrintWhatWasNotSentOfAPublisherWithoutACallback) {
  publisher_->sent = {};
  deliveries_.tell_sent(publisher_, Status(), true);
  deliveries_.tell_sent(publisher_, Status(StatusCode::kLinkDown, "no link is up"), true);
  deliveries_.run();
  EXPECT_EQ(told_, std::vector<std::string>{"no link is up"});
  publisher_->is_closed = true;
  deliveries_.tell_sent(publisher_, Status(StatusCode::kLinkDown, "again"), true);
  deliveries_.run();
  EXPECT_EQ(told_.size(), 1u);
}

/// Whatever comes and is run in whatever order: each message is handed over or told as lost, once,
/// and so is what the daemon lost before it.
TEST_F(DeliveriesAlone, HandOverOrTellAsLostEachMessageOnce) {
  std::mt19937 random(7);
  const auto draw = [&](unsigned below) { return static_cast<unsigned>(random() % below); };
  using std::chrono::seconds;
  std::vector<Policy> policies(6);
  policies[1].keep_last = 1;
  policies[2].keep_last = 4;
  policies[3].max_age = seconds(60);
  policies[4].latest_of_each = true;
  policies[5].latest_of_each = true;
  policies[5].keep_last = 2;
  policies[5].max_age = seconds(60);
  for (const Policy& policy : policies) {
    subscriber_ = std::make_shared<SubscriberState>();
    subscriber_->policy = policy;
    std::uint64_t came = 0, handed_over = 0, lost_before = 0, told_before = 0, told_lost = 0;
    subscriber_->receive = [&](const Message& message) {
      ++handed_over;
      told_lost += message.lost_before.client;
      told_before += message.lost_before.air;
    };
    const auto come = [&](bool is_old, std::uint32_t lost) {
      ipc::DeliverFrame frame;
      frame.sender = draw(3);
      frame.epoch = draw(2);
      if (is_old) frame.received_at_ns = 1;
      frame.lost_before.air = lost;
      deliveries_.deliver(subscriber_, frame, draw(4) == 0);
      ++came;
      lost_before += lost;
    };
    for (int step = 0; step < 3000; ++step) {
      if (draw(10) < 7) {
        come(draw(10) == 0, draw(2));
      } else {
        deliveries_.run();
      }
    }
    deliveries_.run();
    come(false, 0);  // tells what is left
    deliveries_.run();
    EXPECT_EQ(handed_over + told_lost, came);
    EXPECT_EQ(told_before, lost_before);
    EXPECT_EQ(subscriber_->unreported_loss, told_lost);
    EXPECT_GT(handed_over, 500u);
    EXPECT_EQ(told_lost > 0, policy.keep_last || policy.max_age || policy.latest_of_each);
  }
}

TEST_F(DeliveriesAlone, DropWhatIsOlderThanAskedWhenItIsItsTurn) {
  subscriber_->policy.max_age = std::chrono::milliseconds(100);
  for (const std::uint32_t buffered_us : {0u, 60'000u}) {
    ipc::DeliverFrame frame;
    frame.payload = buffered_us > 0 ? "late" : "fresh";
    frame.received_at_ns = static_cast<std::uint64_t>(loop::now().time_since_epoch().count());
    if (buffered_us > 0) frame.buffering_delay_us = buffered_us;
    deliveries_.deliver(subscriber_, frame, false);
  }
  test::pass(std::chrono::milliseconds(100));
  deliveries_.run();
  EXPECT_EQ(told_, std::vector<std::string>{"fresh"});
  EXPECT_EQ(subscriber_->unreported_loss, 1u);
}

TEST_F(DeliveriesAlone, PrintALineASecondForEachCauseAndCountTheRest) {
  Reports reports;
  Deliveries quiet(reports, [] {});
  const auto fail = [&](StatusCode code, const char* text) {
    quiet.report(Status(code, text));
    quiet.run();
  };
  testing::internal::CaptureStderr();
  fail(StatusCode::kRate, "too fast");
  fail(StatusCode::kRate, "too fast");
  fail(StatusCode::kTooLong, "too long");
  test::pass(std::chrono::milliseconds(999));
  fail(StatusCode::kRate, "too fast");
  test::pass(std::chrono::milliseconds(1));
  fail(StatusCode::kRate, "too fast");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "swarmtalk: too fast\nswarmtalk: too long\n"
            "swarmtalk: too fast (3 times since the last line)\n");
}

TEST_F(DeliveriesAlone, TellNothingOnceClosed) {
  deliver("a");
  deliveries_.close(true);
  deliver("b");
  deliveries_.run();
  EXPECT_TRUE(told_.empty());
}

TEST_F(DeliveriesAlone, PrintAtTheEndWhatFailedAndNobodyWasTold) {
  const Status too_fast(StatusCode::kRate, "too fast");
  deliveries_.tell_sent(publisher_, too_fast, false);
  deliveries_.tell_sent(publisher_, too_fast, false);
  deliveries_.report_untold(Status(StatusCode::kTooLong, "too long"));
  deliveries_.tell_sent(publisher_, Status(), false);
  deliveries_.tell_sent(publisher_, Status(StatusCode::kDropped, "as asked"), false);
  deliveries_.tell_sent(publisher_, Status(StatusCode::kDisconnected, "told by itself"), false);
  deliveries_.report(Status(StatusCode::kBadChannel, "answered already"));
  testing::internal::CaptureStderr();
  deliveries_.close(true);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "swarmtalk: a message was not sent: too fast (2 times)\nswarmtalk: too long\n");
  EXPECT_TRUE(told_.empty());
}

}  // namespace
}  // namespace swarmtalk::client
