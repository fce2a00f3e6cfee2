// Registration and its answers, without a connection.
#include "client_lib/handles.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace swarmtalk::client {
namespace {

class HandlesAlone : public testing::Test {
 protected:
  HandlesAlone() {
    auto key = std::make_shared<ChannelKey>();
    key->name = "hello";
    publisher_->key = subscriber_->key = key;
    publisher_->sent = [this](const Status& status) { ends_.push_back(status.code()); };
    deliveries_.callbacks().on_error = [](const Status&) {};
    handles_.add(publisher_);
    handles_.add(subscriber_);
  }
  /// The daemon's, to all that has been asked.
  void answer_all() {
    for (const ipc::Envelope& request : std::exchange(written_, {})) {
      ipc::Envelope answer;
      answer.set_request_id(request.request_id());
      if (request.has_advertise()) answer.mutable_advertised()->set_publisher_id(11);
      if (request.has_subscribe()) answer.mutable_subscribed()->set_subscription_id(12);
      requests_.answer(answer);
    }
  }

  std::mutex gate_;
  Reports reports_;
  Deliveries deliveries_{reports_, [] {}};
  std::vector<ipc::Envelope> written_;
  Requests requests_{[this](const ipc::Envelope& envelope) {
    written_.push_back(envelope);
    return true;
  }};
  int all_registered_ = 0;
  Handles handles_{gate_, requests_, deliveries_, {[this] { ++all_registered_; }, [] {}}};
  std::shared_ptr<PublisherState> publisher_ = std::make_shared<PublisherState>();
  std::shared_ptr<SubscriberState> subscriber_ = std::make_shared<SubscriberState>();
  std::vector<StatusCode> ends_;
};

TEST_F(HandlesAlone, AreRegisteredTogetherAndSayWhenAllAre) {
  handles_.register_all();
  EXPECT_EQ(written_.size(), 2u);
  EXPECT_EQ(all_registered_, 0);
  answer_all();
  EXPECT_EQ(all_registered_, 1);
  EXPECT_EQ(publisher_->id, 11u);
  EXPECT_EQ(subscriber_->id, 12u);
}

TEST_F(HandlesAlone, TellWhatWasOnItsWayWhenTheConnectionIsLost) {
  handles_.register_all();
  answer_all();
  publisher_->in_flight = {1, 2};
  handles_.forget(Status(StatusCode::kDisconnected));
  deliveries_.run();
  EXPECT_EQ(ends_, (std::vector{StatusCode::kDisconnected, StatusCode::kDisconnected}));
  EXPECT_EQ(publisher_->id, 0u);
  EXPECT_TRUE(publisher_->in_flight.empty()) << "they take no room with the next daemon";
  handles_.forget(Status(StatusCode::kDisconnected));
  deliveries_.run();
  EXPECT_EQ(ends_.size(), 2u) << "each once";
}

TEST_F(HandlesAlone, EndAPublicationOnce) {
  handles_.register_all();
  answer_all();
  publisher_->in_flight = {1, 2};
  handles_.end_publication(11, 2, Status(), true);
  handles_.end_publication(11, 2, Status(), true);
  EXPECT_EQ(ends_, std::vector{StatusCode::kOk});
  EXPECT_EQ(publisher_->in_flight, std::deque<std::uint64_t>{1});
}

TEST_F(HandlesAlone, ReportWhatWasLostSinceTheLastReport) {
  handles_.register_all();
  answer_all();
  const auto report = [&](std::uint32_t lost, std::uint32_t refused) {
    subscriber_->unreported_loss += lost;
    publisher_->untold_refusals += refused;
    handles_.report_losses();
    std::vector<std::pair<std::uint32_t, std::uint32_t>> told;
    for (const ipc::Envelope& envelope : std::exchange(written_, {})) {
      const ipc::ClientLoss& loss = envelope.client_loss();
      EXPECT_EQ(loss.has_publisher_id() ? loss.publisher_id() : loss.subscription_id(),
                loss.has_publisher_id() ? 11u : 12u);
      told.emplace_back(loss.messages(), loss.refused());
    }
    return told;
  };
  using Told = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  EXPECT_EQ(report(3, 2), (Told{{0, 2}, {3, 0}}));
  EXPECT_EQ(report(0, 0), Told{});
  EXPECT_EQ(report(1, 0), (Told{{1, 0}}));
  EXPECT_EQ(report(0, 5), (Told{{0, 5}}));
}

TEST_F(HandlesAlone, ThatGoBeforeTheirAnswerAreUnregisteredAfterIt) {
  handles_.register_one(subscriber_);
  handles_.remove(*subscriber_);
  answer_all();
  ASSERT_EQ(written_.size(), 1u);
  EXPECT_EQ(written_[0].unsubscribe().subscription_id(), 12u);
}

}  // namespace
}  // namespace swarmtalk::client
