// What the daemon sends finds the part that it concerns.
#include "client_lib/inbox.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace swarmtalk::client {
namespace {

class InboxAlone : public testing::Test {
 protected:
  InboxAlone() {
    deliveries_.callbacks().on_error = [this](const Status& why) { errors_.push_back(why.code()); };
    auto key = std::make_shared<ChannelKey>();
    publisher_->key = subscriber_->key = key;
    publisher_->sent = [this](const Status& status) { ends_.push_back(status.code()); };
    subscriber_->receive = [this](const Message&) { ++messages_; };
    handles_.add(publisher_);
    handles_.add(subscriber_);
    handles_.register_all();
    for (const ipc::Envelope& request : std::exchange(written_, {})) {
      ipc::Envelope answer;
      answer.set_request_id(request.request_id());
      if (request.has_advertise()) answer.mutable_advertised()->set_publisher_id(11);
      if (request.has_subscribe()) answer.mutable_subscribed()->set_subscription_id(12);
      inbox_.take(answer, false);
    }
    publisher_->in_flight = {1, 2};
  }
  static ipc::Envelope sent(std::uint64_t number) {
    ipc::Envelope envelope;
    envelope.mutable_sent()->set_publisher_id(11);
    envelope.mutable_sent()->set_publish_number(number);
    return envelope;
  }

  std::mutex gate_;
  Reports reports_;
  Deliveries deliveries_{reports_, [] {}};
  std::vector<ipc::Envelope> written_;
  Requests requests_{[this](const ipc::Envelope& envelope) {
    written_.push_back(envelope);
    return true;
  }};
  Handles handles_{gate_, requests_, deliveries_, {[] {}, [] {}}};
  Wakeup wakeup_;
  Silence silence_{requests_, wakeup_, [](const std::string&) {}, std::chrono::milliseconds(0)};
  Inbox inbox_{handles_, requests_, deliveries_, silence_};
  std::shared_ptr<PublisherState> publisher_ = std::make_shared<PublisherState>();
  std::shared_ptr<SubscriberState> subscriber_ = std::make_shared<SubscriberState>();
  int messages_ = 0;
  std::vector<StatusCode> ends_;
  std::vector<StatusCode> errors_;
};

TEST_F(InboxAlone, GivesAnswersToWhoAsked) {
  EXPECT_EQ(publisher_->id, 11u);
  EXPECT_EQ(subscriber_->id, 12u);
}

TEST_F(InboxAlone, GivesAMessageToItsSubscriberAndEndsTheSilence) {
  silence_.expect(subscriber_);
  ipc::DeliverFrame message;
  message.subscription_id = 12;
  inbox_.take(message, true);
  EXPECT_EQ(messages_, 1);
  silence_.watch();
  EXPECT_TRUE(written_.empty()) << "somebody was heard: nobody is asked who is around";
}

TEST_F(InboxAlone, CallsNothingWhileTheProgramWaits) {
  inbox_.take(sent(1), false);
  EXPECT_TRUE(ends_.empty());
  deliveries_.run();
  EXPECT_EQ(ends_, std::vector{StatusCode::kOk});
}

TEST_F(InboxAlone, GivesTheEndOfAPublicationToItsPublisher) {
  inbox_.take(sent(1), true);
  EXPECT_EQ(ends_, std::vector{StatusCode::kOk});
  ipc::Envelope refused;
  refused.mutable_failure()->set_code(ipc::ERROR_LIMIT);
  refused.mutable_failure()->set_publisher_id(11);
  refused.mutable_failure()->set_publish_number(2);
  inbox_.take(refused, true);
  EXPECT_EQ(ends_, (std::vector{StatusCode::kOk, StatusCode::kLimit}));
  EXPECT_TRUE(errors_.empty());
}

TEST_F(InboxAlone, TellsTheProgramOfAFailureThatIsNobodys) {
  silence_.expect(subscriber_);
  ipc::Envelope failure;
  failure.mutable_failure()->set_code(ipc::ERROR_LIMIT);
  inbox_.take(failure, true);
  EXPECT_EQ(errors_, std::vector{StatusCode::kLimit});
  silence_.watch();
  EXPECT_TRUE(written_.empty()) << "it says why nothing is heard";
}

TEST_F(InboxAlone, LeavesOutWhatItDoesNotKnow) {
  inbox_.take(ipc::Envelope(), true);
  EXPECT_TRUE(ends_.empty());
  EXPECT_TRUE(errors_.empty());
}

}  // namespace
}  // namespace swarmtalk::client
