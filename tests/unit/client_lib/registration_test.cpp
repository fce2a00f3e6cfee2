// A new handle becomes known to the daemon, without a connection.
#include "client_lib/registration.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

namespace swarmtalk::client {
namespace {

class RegistrationAlone : public testing::Test {
 protected:
  RegistrationAlone() {
    deliveries_.callbacks().on_error = [this](const Status& why) { errors_.push_back(why.code()); };
    subscriber_->key = key_;
  }
  void answer() {
    ASSERT_EQ(written_.size(), 1u);
    ipc::Envelope answer;
    answer.set_request_id(written_[0].request_id());
    answer.mutable_subscribed()->set_subscription_id(12);
    requests_.answer(answer);
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
  bool has_started_ = true;
  bool is_greeted_ = true;
  Status connected_;
  int connects_ = 0;
  std::function<void()> while_waiting_ = [] {};
  Registration registration_{handles_,
                             deliveries_,
                             {.has_started = [this] { return has_started_; },
                              .connect =
                                  [this] {
                                    ++connects_;
                                    return connected_;
                                  },
                              .is_greeted = [this] { return is_greeted_; },
                              .wait =
                                  [this](const std::function<bool()>& enough) {
                                    while_waiting_();
                                    return enough();
                                  }}};
  std::shared_ptr<ChannelKey> key_ = std::make_shared<ChannelKey>();
  std::shared_ptr<SubscriberState> subscriber_ = std::make_shared<SubscriberState>();
  std::vector<StatusCode> errors_;
};

TEST_F(RegistrationAlone, AsksTheDaemonAndWaitsForTheAnswer) {
  while_waiting_ = [this] { answer(); };
  registration_.add(subscriber_);
  EXPECT_TRUE(subscriber_->status);
  EXPECT_EQ(subscriber_->id, 12u);
  EXPECT_EQ(connects_, 0);
}

TEST_F(RegistrationAlone, TellsThatNoAnswerCame) {
  registration_.add(subscriber_);
  EXPECT_EQ(subscriber_->status.code(), StatusCode::kTimeout);
  deliveries_.run();
  EXPECT_EQ(errors_, std::vector{StatusCode::kTimeout});
}

TEST_F(RegistrationAlone, ConnectsFirstWhichRegistersAll) {
  has_started_ = false;
  connected_ = Status(StatusCode::kNoDaemon);
  registration_.add(subscriber_);
  EXPECT_EQ(connects_, 1);
  EXPECT_TRUE(written_.empty());
  EXPECT_TRUE(handles_.has_subscribers());
  deliveries_.run();
  EXPECT_EQ(errors_, std::vector{StatusCode::kNoDaemon});
}

TEST_F(RegistrationAlone, LeavesItToTheConnectionThatIsBeingMade) {
  is_greeted_ = false;
  registration_.add(subscriber_);
  EXPECT_TRUE(written_.empty());
  EXPECT_TRUE(handles_.has_subscribers());
}

TEST_F(RegistrationAlone, RefusesWhatNoDaemonCouldTake) {
  key_->problem = Status(StatusCode::kBadArgument);
  registration_.add(subscriber_);
  EXPECT_EQ(subscriber_->status.code(), StatusCode::kBadArgument);
  EXPECT_FALSE(handles_.has_subscribers());
  EXPECT_TRUE(written_.empty());
  deliveries_.run();
  EXPECT_EQ(errors_, std::vector{StatusCode::kBadArgument});
}

}  // namespace
}  // namespace swarmtalk::client
