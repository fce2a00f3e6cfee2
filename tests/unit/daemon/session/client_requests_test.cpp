// Requests of one client and what an operator's are answered, without a socket.
#include "daemon/session/client_requests.hpp"

#include <gtest/gtest.h>

#include "tests/unit/daemon/session/client_parts.hpp"

namespace swarmtalk::daemon {
namespace {

class NoStatus final : public StatusSource {
 public:
  void fill_hello(ipc::Hello& hello) override { hello.set_major(ipc::kProtocolMajor); }
  void fill_status(ipc::Status&) override {}
  void fill_neighbours(ipc::Neighbours& reply) override { reply.set_left_out(77); }
};

class AskedOperations final : public Operations {
 public:
  std::optional<Refusal> reload(const std::string& who, ipc::Reloaded&) override {
    asked_by = who;
    return refusal;
  }
  std::optional<Refusal> check_configuration(ipc::Reloaded&) override { return refusal; }
  std::optional<Refusal> set_log_level(const std::string&, const ipc::SetLogLevel&) override {
    return refusal;
  }
  void fill_log_levels(ipc::LogLevels&) override {}
  std::optional<Refusal> set_node_id(const std::string&, std::optional<std::uint32_t>) override {
    return refusal;
  }
  void fill_metrics(ipc::Metrics&) override {}
  void start_capture(const std::string&, CaptureListener& asked) override { listener = &asked; }
  void stop_capture(CaptureListener&) override { listener = nullptr; }

  std::optional<Refusal> refusal;
  std::string asked_by;
  CaptureListener* listener = nullptr;
};

class Requests : public testing::Test {
 protected:
  std::optional<StreamEnd> handle(const ipc::Envelope& request) {
    return requests_.handle(request, requests_left_);
  }
  void greet() {
    ipc::Envelope hello;
    hello.mutable_hello()->set_major(ipc::kProtocolMajor);
    hello.mutable_hello()->set_name("test");
    EXPECT_FALSE(handle(hello));
    parts_.told();
  }

  ClientParts parts_;
  NoStatus status_;
  AskedOperations operator_;
  ChannelTable names_{{}};
  NodeIdentity identity_{5};
  PoseKeeper poses_{NodeConfig{}};
  Hub hub_{names_, parts_.limits, parts_.counters, identity_};
  ClientIdentity client_{"", 0, 0};
  ClientChannels channels_{hub_, parts_.limits, parts_.counters, parts_.output, parts_.answers};
  ClientOperations operations_{&operator_, nullptr,       parts_.limits,
                               client_,    parts_.output, parts_.answers};
  ClientRequests requests_{status_, poses_,         hub_.shares(), parts_.counters,
                           client_, parts_.answers, channels_,     operations_};
  int requests_left_ = 100;
};

TEST_F(Requests, EndTheStreamOfAClientThatDoesNotGreet) {
  ipc::Envelope request;
  request.mutable_get_pose();
  const auto end = handle(request);
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->is_malformed);
  EXPECT_TRUE(parts_.told().empty());
}

TEST_F(Requests, EndTheStreamOfAnotherVersion) {
  ipc::Envelope hello;
  hello.mutable_hello()->set_major(ipc::kProtocolMajor + 1);
  const auto end = handle(hello);
  ASSERT_TRUE(end);
  EXPECT_EQ(end->code, ipc::ERROR_VERSION);
  EXPECT_FALSE(requests_.has_greeted());
}

TEST_F(Requests, TakeAStatusForManyCheapRequests) {
  greet();
  ipc::Envelope request;
  request.mutable_get_status();
  EXPECT_FALSE(handle(request));
  EXPECT_LT(requests_left_, 100);
  EXPECT_TRUE(parts_.told().at(0).has_status());
}

TEST_F(Requests, TellAnOperatorWhyNotAndTheDaemonWhoAsked) {
  greet();
  operator_.refusal = Refusal{ipc::ERROR_BAD_ARGUMENT, "no", std::nullopt};
  ipc::Envelope request;
  request.set_request_id(5);
  request.mutable_reload();
  EXPECT_FALSE(handle(request));
  EXPECT_EQ(operator_.asked_by, "client 'test' (pid 0, uid 0)");
  const auto told = parts_.told();
  EXPECT_EQ(told.at(0).failure().text(), "no");
  EXPECT_EQ(told.at(0).request_id(), 5u);
}

TEST_F(Requests, TellOnceOfTheFramesThatASlowCaptureMissed) {
  greet();
  ipc::Envelope request;
  request.mutable_capture();
  EXPECT_FALSE(handle(request));
  ASSERT_NE(operator_.listener, nullptr);
  const auto capture = [&](std::uint32_t limit) {
    ipc::Captured captured;
    parts_.limits.reply_bytes = limit;
    operator_.listener->on_captured(captured);
  };
  for (const std::uint32_t limit : {0, 0, 100'000, 100'000, 0, 100'000}) capture(limit);
  const auto told = parts_.told();
  ASSERT_EQ(told.size(), 4u);
  EXPECT_TRUE(told[0].has_done());
  EXPECT_EQ(told[1].captured().missed(), 2u);
  EXPECT_EQ(told[2].captured().missed(), 0u);
  EXPECT_EQ(told[3].captured().missed(), 1u);
  operations_.leave();
  EXPECT_EQ(operator_.listener, nullptr);
}

TEST_F(Requests, AskTheDaemonForItsNeighbours) {
  greet();
  ipc::Envelope request;
  request.set_request_id(8);
  request.mutable_get_neighbours();
  EXPECT_FALSE(handle(request));
  const auto told = parts_.told();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].request_id(), 8u);
  EXPECT_EQ(told[0].neighbours().left_out(), 77u);
}

TEST_F(Requests, SayThatThereAreNoKilobots) {
  greet();
  ipc::Envelope request;
  request.mutable_kilobot_command();
  EXPECT_FALSE(handle(request));
  EXPECT_EQ(parts_.told().at(0).failure().code(), ipc::ERROR_BAD_COMMAND);
}

}  // namespace
}  // namespace swarmtalk::daemon
