#include "client_lib/requests.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace swarmtalk::client {
namespace {

class RequestsAlone : public testing::Test {
 protected:
  ipc::Envelope answer_to(std::uint32_t id) {
    ipc::Envelope answer;
    answer.set_request_id(id);
    answer.mutable_done();
    return answer;
  }

  bool has_room_ = true;
  std::vector<ipc::Envelope> written_;
  Requests requests_{[this](const ipc::Envelope& envelope) {
    if (has_room_) written_.push_back(envelope);
    return has_room_;
  }};
  std::vector<StatusCode> done_;
  Requests::Completion note_ = [this](const ipc::Envelope*, const Status& status) {
    done_.push_back(status.code());
  };
};

TEST_F(RequestsAlone, BringEachAnswerToWhoAsked) {
  requests_.make().mutable_get_pose();
  const auto first = requests_.send([](const ipc::Envelope*, const Status&) { FAIL(); });
  requests_.make().mutable_get_status();
  const auto second = requests_.send(note_);
  ASSERT_EQ(written_.size(), 2u);
  EXPECT_NE(first, second);
  EXPECT_EQ(written_[1].request_id(), second);
  EXPECT_TRUE(written_[1].has_get_status());
  requests_.answer(answer_to(second));
  EXPECT_EQ(done_, std::vector{StatusCode::kOk});
  requests_.answer(answer_to(second));
  EXPECT_EQ(done_.size(), 1u);
  requests_.abandon(first);
  requests_.answer(answer_to(first));
  EXPECT_TRUE(requests_.is_empty());
}

TEST_F(RequestsAlone, AnswerAllThatWaitsWhenTheConnectionIsLost) {
  requests_.make();
  requests_.send(note_);
  requests_.make();
  requests_.send(note_);
  requests_.fail_all(Status(StatusCode::kDisconnected));
  EXPECT_EQ(done_, (std::vector{StatusCode::kDisconnected, StatusCode::kDisconnected}));
  requests_.make();
  const auto third = requests_.send(note_);
  requests_.fail_all(Status(StatusCode::kProtocol));
  ASSERT_EQ(done_.size(), 3u) << "each once";
  EXPECT_EQ(done_[2], StatusCode::kProtocol);
  requests_.answer(answer_to(third));
  EXPECT_EQ(done_.size(), 3u);
}

TEST_F(RequestsAlone, RefuseWhatIsTooLongForAFrame) {
  has_room_ = false;
  requests_.make();
  requests_.send(note_);
  EXPECT_EQ(done_, std::vector{StatusCode::kBadArgument});
  EXPECT_TRUE(requests_.is_empty());
}

TEST_F(RequestsAlone, KeepTheFirstRefusalOfWhatNobodyWaitsFor) {
  requests_.make();
  requests_.send_only();
  ipc::Envelope refusal;
  refusal.set_request_id(written_.at(0).request_id());
  refusal.mutable_failure()->set_code(ipc::ERROR_LIMIT);
  requests_.answer(refusal);
  requests_.note_refusal(Status(StatusCode::kBadPose));
  EXPECT_EQ(requests_.take_refusal().code(), StatusCode::kLimit);
  EXPECT_TRUE(requests_.take_refusal().ok());
}

}  // namespace
}  // namespace swarmtalk::client
