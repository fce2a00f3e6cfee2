// Requests of an operator, as a session answers them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "tests/unit/daemon/session/session_harness.hpp"

namespace swarmtalk::daemon {
namespace {

using testing::ElementsAre;

/// An operator whose reload does what the test says.
class FakeOperations final : public Operations {
 public:
  std::optional<Refusal> reload(const std::string&, ipc::Reloaded& reply) override {
    on_reload();
    reply.add_applied("links.wifi.key_file");
    return std::nullopt;
  }
  std::optional<Refusal> check_configuration(ipc::Reloaded&) override { return std::nullopt; }
  std::optional<Refusal> set_log_level(const std::string&, const ipc::SetLogLevel&) override {
    return std::nullopt;
  }
  void fill_log_levels(ipc::LogLevels&) override {}
  std::optional<Refusal> set_node_id(const std::string&, std::optional<std::uint32_t>) override {
    return std::nullopt;
  }
  void fill_metrics(ipc::Metrics&) override {}
  void start_capture(const std::string&, CaptureListener&) override {}
  void stop_capture(CaptureListener&) override {}

  std::function<void()> on_reload = [] {};
};

class SessionOperationsTest : public SessionTest {
 protected:
  SessionOperationsTest() { clients_.operations = &operations_; }

  FakeOperations operations_;
};

TEST_F(SessionOperationsTest, ReloadsThatCameAtOnceAreOne) {
  auto peer = greeted();
  int reloads = 0;
  operations_.on_reload = [&reloads] { ++reloads; };
  std::string bytes;
  for (std::uint32_t i = 1; i <= 256; ++i) {
    ipc::Envelope request;
    request.set_request_id(i);
    request.mutable_reload();
    ASSERT_TRUE(ipc::append_frame(request, bytes));
  }
  peer->send_bytes(bytes);
  step();
  const auto answers = peer->receive();
  ASSERT_EQ(answers.size(), 256u);
  EXPECT_EQ(reloads, 1);
  for (std::uint32_t i = 0; i < answers.size(); ++i) {
    EXPECT_EQ(answers[i].request_id(), i + 1);
    EXPECT_THAT(answers[i].reloaded().applied(), ElementsAre("links.wifi.key_file"));
  }
  peer->send_bytes(bytes.substr(0, bytes.size() / 256));
  step();
  EXPECT_EQ(reloads, 2) << "the file may have changed since";
}

TEST_F(SessionOperationsTest, ChangesFasterThanTheirRateAreRefused) {
  limits_.changes_burst = 5;
  auto peer = greeted();
  hub_.shares().user(getuid()).changes = TokenBucket(1, limits_.changes_burst);
  int refused = 0;
  for (std::uint32_t i = 1; i <= 20; ++i) {
    ipc::Envelope request;
    request.set_request_id(i);
    request.mutable_set_node_id()->set_node_id(i);
    peer->send(request);
    step();
    refused += peer->receive().at(0).failure().code() == ipc::ERROR_RATE ? 1 : 0;
  }
  EXPECT_GE(refused, 10);
  EXPECT_EQ(counters_.requests_too_fast, static_cast<std::uint64_t>(refused));
}

TEST_F(SessionOperationsTest, ReloadIsAnsweredAlsoWhenItTakesTheLinkDown) {
  auto peer = greeted();
  subscribed(*peer, "hello");
  operations_.on_reload = [this] {
    station_.set_up(false);
    hub_.on_link_state(station_);
  };
  ipc::Envelope request;
  request.set_request_id(77);
  request.mutable_reload();
  peer->send(request);
  step();
  const auto told = peer->receive();
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].failure().code(), ipc::ERROR_LINK_DOWN);
  EXPECT_EQ(told[0].request_id(), 0u) << "nobody asked";
  EXPECT_EQ(told[1].request_id(), 77u);
  EXPECT_FALSE(told[1].has_failure());
  EXPECT_THAT(told[1].reloaded().applied(), ElementsAre("links.wifi.key_file"));
}

TEST_F(SessionTest, RequestsThatCountAsManyAreGoneOnWithInTheNextTurn) {
  auto peer = greeted();
  std::string bytes;
  for (std::uint32_t id = 1; id <= 20; ++id) {
    ipc::Envelope request;
    request.set_request_id(id);
    request.mutable_get_status();
    ASSERT_TRUE(ipc::append_frame(request, bytes));
  }
  peer->send_bytes(bytes);
  step();
  EXPECT_EQ(peer->receive().size(), 20u);
}

TEST_F(SessionTest, AFloodOfRequestsKeepsAnotherWaitingForFewOfThem) {
  auto flooding = greeted();
  auto other = greeted();
  std::string bytes;
  for (std::uint32_t id = 1; id <= 500; ++id) {
    ipc::Envelope request;
    request.set_request_id(id);
    request.mutable_get_pose();
    ASSERT_TRUE(ipc::append_frame(request, bytes));
  }
  flooding->send_bytes(bytes);
  ipc::Envelope request;
  request.set_request_id(1);
  request.mutable_get_pose();
  other->send(request);
  std::size_t answers = 0;
  for (int turn = 0; turn < 1000 && answers == 0; ++turn) {
    io_.restart();
    io_.poll_one();
    answers = other->receive().size();
  }
  EXPECT_EQ(answers, 1u);
  const std::size_t before_it = flooding->receive().size();
  EXPECT_LE(before_it, 32u) << "of 500";
  step();
  EXPECT_EQ(before_it + flooding->receive().size(), 500u);
}

}  // namespace
}  // namespace swarmtalk::daemon
