// PoseSocket: a Unix datagram socket that takes poses as text, one in each datagram, so that
// whoever knows where the robot is can tell it in three lines of any language. The last writer
// counts. What is not a pose is counted and told once a second. On the daemon's thread.
#pragma once

#include <array>
#include <boost/asio/io_context.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <optional>
#include <string>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/common/log_limiter.hpp"
#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "daemon/host/socket_watch.hpp"
#include "daemon/host/unix_socket_file.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/pose/pose_text.hpp"

namespace swarmtalk::daemon {

class PoseSocket {
 public:
  /// Makes the socket, with mode and group of `access`. A socket at that path that nobody reads is
  /// replaced. References must outlive it.
  /// @throws ConfigError  at node.pose_socket or socket.group: path taken, not writable, no group
  PoseSocket(boost::asio::io_context& io, const std::string& path, const SocketConfig& access,
             const KeyLines& lines, PoseKeeper& poses, DaemonCounters& counters);

  /// Begins to read. From then on, a socket file that somebody deletes is made again.
  void start();

 private:
  void open();
  bool restore();
  void wait();
  void read_all();
  void take(std::string_view text);

  boost::asio::io_context& io_;
  UnixSocketFile file_;
  SocketConfig access_;
  KeyLines lines_;
  PoseKeeper& poses_;
  DaemonCounters& counters_;
  boost::asio::posix::stream_descriptor socket_;
  LogLimiter log_;
  std::optional<SocketWatch> watch_;
  bool is_gone_ = false;
  std::array<char, kMaxPoseTextBytes + 1> buffer_{};  // one more: what is too long looks so
};

}  // namespace swarmtalk::daemon
