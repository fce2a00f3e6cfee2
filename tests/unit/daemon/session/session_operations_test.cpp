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

}  // namespace
}  // namespace swarmtalk::daemon
