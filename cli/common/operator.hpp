// OperatorConnection: the CLI's own talk with the daemon, for requests that robot programs have no
// use for and that the client library therefore does not offer. Blocks, with a limit.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include <swarmtalk/client.hpp>

#include "client_lib/connection.hpp"

namespace swarmtalk::cli {

class OperatorConnection {
 public:
  /// Connects and greets. @param configured_path  empty: $SWARMTALK_SOCKET, or the standard one
  Status open(const std::string& configured_path);

  /// Sends one request, with an id of its own, and waits for its answer, at most 5 s.
  /// @return of a failure its text
  Status request(ipc::Envelope& question, ipc::Envelope& answer);

  /// The next envelope, whatever it is. Comes back at once, with an unchanged envelope, when a
  /// signal was caught (caught_signal()).
  Status next(ipc::Envelope& envelope, std::chrono::milliseconds timeout);

  /// Readable when next() may have something; -1 before open().
  int fd() const { return connection_.fd(); }

 private:
  static Status lost();

  client::Connection connection_;
  std::uint32_t last_id_ = 0;
};

}  // namespace swarmtalk::cli
