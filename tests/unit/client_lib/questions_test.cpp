// What a program asks and tells the daemon, answered by the test.
#include "client_lib/questions.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "client_lib/pose_updates.hpp"

namespace swarmtalk::client {
namespace {

/// What is asked is kept, and answered by answer() while a question waits.
class AskedAlone : public testing::Test {
 protected:
  std::vector<ipc::Envelope> written_;
  Requests requests_{[this](const ipc::Envelope& envelope) {
    written_.push_back(envelope);
    return true;
  }};
  /// @param fill  of the answer to the oldest request
  void answer(const std::function<void(ipc::Envelope&)>& fill) {
    ASSERT_FALSE(written_.empty());
    ipc::Envelope envelope;
    envelope.set_request_id(written_.front().request_id());
    written_.erase(written_.begin());
    fill(envelope);
    requests_.answer(envelope);
  }
};

class QuestionsAlone : public AskedAlone {
 protected:
  Status present_;
  std::function<void()> while_waiting_ = [] {};
  Questions questions_{requests_,
                       std::chrono::milliseconds(1000),
                       {[this] { return present_; },
                        [this](Wakeup::Clock::time_point, const std::function<bool()>& enough) {
                          while_waiting_();
                          return enough();
                        }}};
};

TEST_F(QuestionsAlone, BringTheAnswer) {
  while_waiting_ = [this] {
    answer([](ipc::Envelope& envelope) {
      auto& pose = *envelope.mutable_pose();
      pose.set_x_m(1);
      pose.set_y_m(2);
      pose.set_theta_rad(3);
    });
  };
  std::optional<Pose> pose;
  EXPECT_TRUE(questions_.get_pose(pose));
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->y_m, 2);
}

TEST_F(QuestionsAlone, AreNotAskedWithoutADaemon) {
  present_ = Status(StatusCode::kNoDaemon);
  DaemonStatus status;
  std::vector<Neighbour> neighbours;
  EXPECT_EQ(questions_.get_status(status).code(), StatusCode::kNoDaemon);
  EXPECT_EQ(questions_.get_neighbours(neighbours).code(), StatusCode::kNoDaemon);
  EXPECT_TRUE(written_.empty());
}

TEST_F(QuestionsAlone, GiveUpInTimeAndForgetWhatTheyAsked) {
  std::optional<Pose> pose;
  EXPECT_EQ(questions_.get_pose(pose).code(), StatusCode::kTimeout);
  EXPECT_TRUE(requests_.is_empty()) << "the answer would be written to a variable that is gone";
}

TEST_F(QuestionsAlone, SyncTellsTheFirstRefusal) {
  requests_.make().mutable_unsubscribe()->set_subscription_id(1);
  requests_.send_only();
  while_waiting_ = [this] {
    answer([](ipc::Envelope& envelope) { envelope.mutable_failure()->set_code(ipc::ERROR_LIMIT); });
  };
  EXPECT_EQ(questions_.sync([] { return true; }).code(), StatusCode::kLimit);
  while_waiting_ = [] {};
  EXPECT_TRUE(questions_.sync([] { return true; }));
  EXPECT_EQ(questions_.sync([] { return false; }).code(), StatusCode::kTimeout);
  while_waiting_ = [this] { present_ = Status(StatusCode::kNoDaemon); };
  EXPECT_EQ(questions_.sync([] { return true; }).code(), StatusCode::kDisconnected)
      << "lost while it waited";
}

class PoseUpdatesAlone : public AskedAlone {
 protected:
  PoseUpdatesAlone() {
    deliveries_.callbacks().on_error = [this](const Status& why) { errors_.push_back(why.code()); };
  }
  void done() {
    answer([](ipc::Envelope& envelope) { envelope.mutable_done(); });
  }

  Reports reports_;
  Deliveries deliveries_{reports_, [] {}};
  std::vector<StatusCode> errors_;
  std::vector<std::string> hints_;
  int waiting_ = 0;
  std::function<void()> look_ = [] {};
  PoseUpdates poses_{requests_,
                     deliveries_,
                     {[this] { ++waiting_; }, [this] { look_(); },
                      [this](const std::string& text) { hints_.push_back(text); }}};
  void fill() {
    for (std::size_t i = 0; i < kMost; ++i) EXPECT_TRUE(poses_.set({1, 0, 0}));
  }
  static constexpr std::size_t kMost = 64;
};

TEST_F(PoseUpdatesAlone, GoOutAtOnceUntilManyAnswersAreAwaitedAndThenTheNewest) {
  fill();
  EXPECT_EQ(written_.size(), kMost);
  EXPECT_EQ(waiting_, static_cast<int>(kMost));
  EXPECT_TRUE(poses_.set({2, 0, 0}));
  EXPECT_TRUE(poses_.set({3, 0, 0}));
  EXPECT_EQ(written_.size(), kMost);
  EXPECT_TRUE(poses_.is_waiting());
  done();
  ASSERT_EQ(written_.size(), kMost);
  EXPECT_EQ(written_.back().set_pose().x_m(), 3);
  EXPECT_FALSE(poses_.is_waiting());
}

TEST_F(PoseUpdatesAlone, LookForAnswersThemselvesWhenMany) {
  look_ = [this] {
    while (!written_.empty()) done();
  };
  fill();
  EXPECT_TRUE(poses_.set({2, 0, 0}));
  ASSERT_EQ(written_.size(), 1u);
  EXPECT_EQ(written_[0].set_pose().x_m(), 2);
}

TEST_F(PoseUpdatesAlone, SendTheRestAtTheEnd) {
  EXPECT_FALSE(poses_.is_unanswered());
  poses_.send_rest();
  fill();
  EXPECT_TRUE(poses_.set({2, 0, 0}));
  EXPECT_TRUE(poses_.is_unanswered());
  poses_.send_rest();
  ASSERT_EQ(written_.size(), kMost + 1);
  EXPECT_EQ(written_.back().set_pose().x_m(), 2);
  poses_.send_rest();
  EXPECT_EQ(written_.size(), kMost + 1);
}

TEST_F(PoseUpdatesAlone, RefuseWhatIsNotAPlaceAndReportIt) {
  for (const OwnPose& pose : {OwnPose{33, 0, 0}, OwnPose{0, NAN, 0}, OwnPose{0, 0, INFINITY}}) {
    EXPECT_EQ(poses_.set(pose).code(), StatusCode::kBadPose);
  }
  deliveries_.run();
  EXPECT_EQ(errors_.size(), 3u);
  EXPECT_TRUE(written_.empty());
}

TEST_F(PoseUpdatesAlone, TellOnceThatAHeadingLooksLikeDegrees) {
  EXPECT_TRUE(poses_.set({0, 0, -6.2831855f}));
  EXPECT_TRUE(hints_.empty()) << "a whole turn is none too many";
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(poses_.set({0, 0, 90}));
  ASSERT_EQ(hints_.size(), 1u);
  EXPECT_NE(hints_[0].find("in radians; 90 is more than a whole turn and looks like degrees, which "
                           "are 1.5708 radians"),
            std::string::npos)
      << hints_[0];
}

TEST_F(PoseUpdatesAlone, ForgetWhatWaitedWithALostConnection) {
  fill();
  EXPECT_TRUE(poses_.set({2, 0, 0}));
  requests_.fail_all(Status(StatusCode::kDisconnected));
  poses_.forget();
  EXPECT_FALSE(poses_.is_waiting());
  written_.clear();
  EXPECT_TRUE(poses_.set({3, 0, 0}));
  ASSERT_EQ(written_.size(), 1u);
  EXPECT_EQ(written_[0].set_pose().x_m(), 3);
}

}  // namespace
}  // namespace swarmtalk::client
