// Questions: what a program asks the daemon and waits for. On the owner's thread.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include <swarmtalk/client/daemon_status.hpp>
#include <swarmtalk/client/message.hpp>
#include <swarmtalk/client/status.hpp>

#include "client_lib/requests.hpp"
#include "client_lib/wakeup.hpp"

namespace swarmtalk::client {

class Questions {
 public:
  struct Hooks {
    std::function<Status()> require;  // kOk: there is somebody to ask
    std::function<bool(Wakeup::Clock::time_point, const std::function<bool()>& enough)> wait_until;
  };

  /// All must outlive it. @param timeout  of each question
  Questions(Requests& requests, std::chrono::milliseconds timeout, Hooks hooks)
      : requests_(requests), timeout_(timeout), hooks_(std::move(hooks)) {}

  // Contracts in client.hpp.
  Status get_status(DaemonStatus& status);
  Status get_neighbours(std::vector<Neighbour>& neighbours);
  Status get_pose(std::optional<Pose>& pose);
  /// @param is_idle  nothing more is going to be asked
  Status sync(const std::function<bool()>& is_idle);
  /// Waits for an answer as long as a question does. @return enough()
  bool wait(const std::function<bool()>& enough);

 private:
  Status ask(const std::function<void(const ipc::Envelope&)>& use);

  Requests& requests_;
  std::chrono::milliseconds timeout_;
  Hooks hooks_;
};

}  // namespace swarmtalk::client
