// Answerer: the daemon's own voice on the channel "harvest". While somebody looks it reports what
// this robot is and does, and passes on what robots farther away have said (docs/wire-format.md,
// Reports). A client of the hub like any session; on the daemon's thread.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daemon/answer/gatherer.hpp"
#include "daemon/answer/own_channel.hpp"
#include "daemon/answer/own_record.hpp"
#include "daemon/common/daemon_counters.hpp"
#include "daemon/hub/hub.hpp"

namespace swarmtalk::daemon {

class Answerer final : public HubClient {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// Between two questions to this robot's programs, while its details are wanted.
  static constexpr auto kAskPeriod = std::chrono::seconds(10);

  /// All references must outlive it.
  Answerer(Hub& hub, const NodeIdentity& identity, const PoseKeeper& poses,
           DaemonCounters& counters, std::function<std::vector<std::string>()> programs);

  /// What the robot is called; empty: nothing.
  void set_name(std::string name) { record_.set_name(std::move(name)); }

  /// Begins to listen. @return why it cannot; the daemon runs all the same
  std::optional<Refusal> start();

  /// Called with the time at which report() is to be called, whenever that changes. Must be cheap.
  void set_hook(std::function<void(Time)> hook) { hook_ = std::move(hook); }

  /// Sends what is due, and tells the hook when next.
  void report(Time now);

  void on_message(Subscription& subscription, const MessageRef& message) override;
  void on_sent(Publisher&, std::uint64_t) override {}
  void on_unsent(std::uint32_t, std::uint64_t, const Refusal&) override {}

 private:
  void plan();
  void ask_programs(Time now);

  const NodeIdentity& identity_;
  DaemonCounters& counters_;
  OwnRecord record_;
  Gatherer gatherer_;
  OwnChannel channel_;
  std::function<void(Time)> hook_ = [](Time) {};
  std::optional<Time> told_;    // to the hook
  std::uint32_t question_ = 0;  // to programs; 0: none yet
  std::optional<Time> asked_at_;
};

}  // namespace swarmtalk::daemon
