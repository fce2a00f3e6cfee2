// Daemon: puts the parts together and runs them on the calling thread until a signal ends it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/answer/answerer.hpp"
#include "daemon/answer/ping_answerer.hpp"
#include "daemon/config/config_parser.hpp"
#include "daemon/host/listening_socket.hpp"
#include "daemon/host/service_manager.hpp"
#include "daemon/host/socket_watch.hpp"
#include "daemon/hub/hub.hpp"
#include "daemon/kilobot/kilobot_control.hpp"
#include "daemon/operator/capture.hpp"
#include "daemon/operator/metrics_file.hpp"
#include "daemon/operator/operator.hpp"
#include "daemon/operator/status_report.hpp"
#include "daemon/pose/pose_socket.hpp"
#include "daemon/session/clients.hpp"
#include "daemon/station/station.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::daemon {

class Daemon {
 public:
  /// Opens every socket.
  /// @param load  reads the configuration again; throws ConfigError
  /// @throws ConfigError  one line with the remedy
  Daemon(ParsedConfig parsed, std::function<ParsedConfig()> load);
  ~Daemon();

  /// Drops all privileges, then serves until SIGTERM or SIGINT.
  /// @throws std::runtime_error  privileges cannot be dropped
  void run();

 private:
  void open_stations();
  void add_kilobots(const LinkConfig& link, Station& station);
  NodeIdentity& identity_for(const LinkConfig& link);
  void wait_signal();
  void on_signal(int signal);
  void watch_links();
  void wait_for_copy(Hub::Time at);
  void start_answering();
  void wait_for_report(Answerer::Time at);
  bool restore_socket();
  std::string status_line() const;

  ParsedConfig parsed_;
  boost::asio::io_context io_{BOOST_ASIO_CONCURRENCY_HINT_UNSAFE};  // one thread: no locks
  boost::asio::signal_set signals_;  // before the socket: a signal while starting ends it cleanly
  DaemonCounters counters_;
  NodeIdentity identity_;
  PoseKeeper poses_;
  ChannelTable names_;
  Hub hub_;
  StatusReport status_;
  std::vector<std::unique_ptr<NodeIdentity>> link_identities_;  // of links with ids of their own
  KilobotControl kilobots_;  // behind the sessions, before the links
  std::vector<std::unique_ptr<Station>> stations_;
  ListeningSocket socket_;
  std::optional<PoseSocket> pose_socket_;  // none: not configured
  Clients clients_;
  std::optional<Answerer> answerer_;           // none: reserved.report is off
  std::optional<PingAnswerer> ping_answerer_;  // the same
  std::optional<loop::Deferred> pings_;        // its answers, at the end of a turn
  MetricsFile metrics_;
  Capture capture_;
  Operator operator_;
  ServiceManager service_manager_;
  std::optional<SocketWatch> socket_watch_;
  loop::Timer link_timer_;
  loop::Timer copy_timer_;
  loop::Timer report_timer_;
  bool is_socket_gone_ = false;
};

}  // namespace swarmtalk::daemon
