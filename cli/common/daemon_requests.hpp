// One connection to the daemon for commands that are not messages: sends requests, waits for the
// frames that come back. Signals interrupt a wait. Single-threaded.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include <swarmtalk/client/status.hpp>

#include "client_lib/connection.hpp"
#include "ipc/framing.hpp"

namespace swarmtalk::cli {

class DaemonRequests {
 public:
  /// Connects and greets. @param socket_path  empty: the usual one
  [[nodiscard]] Status connect(const std::string& socket_path);

  /// Sends one request, with an id of its own. @return kOk, kDisconnected, kTooLong
  [[nodiscard]] Status send(ipc::Envelope& request);

  /// Waits for a frame, a signal or the end of time.
  /// @return none: nothing came; `status` is not kOk when the daemon is gone
  std::optional<ipc::Envelope> wait(std::chrono::milliseconds timeout, Status& status);

 private:
  client::Connection connection_;
  std::uint32_t last_id_ = 0;
};

}  // namespace swarmtalk::cli
