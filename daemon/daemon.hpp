// Daemon: puts the parts together and runs them on the calling thread until a signal ends it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <vector>

#include "daemon/clients.hpp"
#include "daemon/config_parser.hpp"
#include "daemon/hub.hpp"
#include "daemon/kilobot_control.hpp"
#include "daemon/listening_socket.hpp"
#include "daemon/station.hpp"
#include "daemon/status_report.hpp"

namespace swarmtalk::daemon {

class Daemon {
 public:
  /// Opens every socket. @param parsed  kept by reference
  /// @throws ConfigError  one line with the remedy
  explicit Daemon(const ParsedConfig& parsed);
  ~Daemon();

  /// Drops all privileges, then serves until SIGTERM or SIGINT.
  /// @throws std::runtime_error  privileges cannot be dropped
  void run();

 private:
  void open_stations(const KeyLines& lines);
  void add_kilobots(const LinkConfig& link, Station& station);
  NodeIdentity& identity_for(const LinkConfig& link);
  void wait_signal();
  void watch_links();
  void wait_for_copy(Hub::Time at);
  void notify_ready() const;

  const Config& config_;
  boost::asio::io_context io_{1};
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
  Clients clients_;
  boost::asio::signal_set signals_;
  boost::asio::steady_timer link_timer_;
  boost::asio::steady_timer copy_timer_;
  bool is_watching_links_ = false;
};

}  // namespace swarmtalk::daemon
