// Daemon: a robot in a process: its sockets on this machine, signals, privileges and systemd. Runs
// on the calling thread until a signal ends it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <functional>
#include <optional>

#include "daemon/config/config_parser.hpp"
#include "daemon/host/listening_socket.hpp"
#include "daemon/host/service_manager.hpp"
#include "daemon/host/socket_watch.hpp"
#include "daemon/pose/pose_socket.hpp"
#include "daemon/robot.hpp"

namespace swarmtalk::daemon {

class Daemon {
 public:
  /// Opens every socket.
  /// @param load  reads the configuration again; throws ConfigError
  /// @throws ConfigError  one line with the remedy
  Daemon(ParsedConfig parsed, std::function<ParsedConfig()> load);

  /// Drops all privileges, then serves until SIGTERM or SIGINT.
  /// @throws std::runtime_error  privileges cannot be dropped
  void run();

 private:
  void wait_signal();
  void on_signal(int signal);
  bool restore_socket();
  const ParsedConfig& parsed() const { return robot_.parsed(); }

  boost::asio::io_context io_{BOOST_ASIO_CONCURRENCY_HINT_UNSAFE};  // one thread: no locks
  boost::asio::signal_set signals_;  // before the socket: a signal while starting ends it cleanly
  ListeningSocket socket_;
  Robot robot_;
  std::optional<PoseSocket> pose_socket_;  // none: not configured
  ServiceManager service_manager_;
  std::optional<SocketWatch> socket_watch_;
  bool is_socket_gone_ = false;
};

}  // namespace swarmtalk::daemon
