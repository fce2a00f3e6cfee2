// PingAnswerer: answers `swarmtalk-cli ping` for this robot, so that no program has to run there
// (docs/wire-format.md, Ping). At most kRateHz answers a second, whoever asks; a question that is
// not for this robot costs nothing. A client of the hub like any session; on the daemon's thread.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/answer/own_channel.hpp"
#include "daemon/common/daemon_counters.hpp"
#include "daemon/common/token_bucket.hpp"
#include "daemon/hub/hub.hpp"

namespace swarmtalk::daemon {

class PingAnswerer final : public HubClient {
 public:
  static constexpr std::uint32_t kRateHz = 5;
  static constexpr std::uint32_t kBurst = 100;     // doctor asks 75 at once
  static constexpr std::size_t kMostRuns = 64;     // whose questions are counted
  static constexpr std::size_t kMostAnswers = 32;  // that wait to be sent

  /// All references must outlive it.
  PingAnswerer(Hub& hub, const NodeIdentity& identity, DaemonCounters& counters);

  /// Begins to listen. @return why it cannot; the daemon runs all the same
  std::optional<Refusal> start();

  /// Called when answers wait for answer(). Must be cheap.
  void set_hook(std::function<void()> hook) { hook_ = std::move(hook); }

  /// Sends what waits.
  void answer();

  void on_message(Subscription& subscription, const MessageRef& message) override;
  void on_sent(Publisher&, std::uint64_t) override {}
  void on_unsent(std::uint32_t, std::uint64_t, const Refusal&) override {}

 private:
  struct Answer {
    std::string text;
    std::uint32_t ttl = 0;
  };

  const NodeIdentity& identity_;
  DaemonCounters& counters_;
  OwnChannel channel_;
  TokenBucket bucket_{kRateHz, kBurst};
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> heard_;  // by sender and run
  std::vector<Answer> answers_;
  std::function<void()> hook_ = [] {};
};

}  // namespace swarmtalk::daemon
