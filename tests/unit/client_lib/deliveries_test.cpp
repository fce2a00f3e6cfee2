// What a program is told, and in which order, without a connection.
#include "client_lib/deliveries.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

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
