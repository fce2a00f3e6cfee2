// Robot: what of the daemon knows nothing of its process (signals, sockets of this machine,
// systemd): links, hub, programs' sessions, and what answers about them. Its programs are handed to
// it as descriptors. One thread, which runs the io_context.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/answer/answerer.hpp"
#include "daemon/answer/ping_answerer.hpp"
#include "daemon/config/config_parser.hpp"
#include "daemon/hub/hub.hpp"
#include "daemon/kilobot/kilobot_control.hpp"
#include "daemon/operator/capture.hpp"
#include "daemon/operator/metrics_file.hpp"
#include "daemon/operator/operator.hpp"
#include "daemon/operator/status_report.hpp"
#include "daemon/session/clients.hpp"
#include "daemon/station/station.hpp"
#include "daemon/station/station_factory.hpp"
#include "loop/loop.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::daemon {

class Robot {
 public:
  /// Opens every link.
  /// @param parsed  its node id is resolved (resolve_node_id())
  /// @param load    reads the configuration again; throws ConfigError
  /// @param open    called during the call
  /// @throws ConfigError  one line with the remedy
  Robot(boost::asio::io_context& io, ParsedConfig parsed, std::function<ParsedConfig()> load,
        const LinkOpener& open);
  ~Robot();

  /// The links send and receive from now on.
  void start();

  /// "node 5, link wifi up, 0 clients"
  std::string status_line() const;
  const ParsedConfig& parsed() const { return parsed_; }
  const NodeIdentity& identity() const { return identity_; }
  DaemonCounters& counters() { return counters_; }
  PoseKeeper& poses() { return poses_; }
  Hub& hub() { return hub_; }
  Clients& clients() { return clients_; }
  Operator& operations() { return operator_; }

 private:
  void open_stations(const LinkOpener& open);
  void add_kilobots(const LinkConfig& link, Station& station);
  NodeIdentity& identity_for(const LinkConfig& link);
  void watch_links();
  void start_answering();

  boost::asio::io_context& io_;
  ParsedConfig parsed_;
  DaemonCounters counters_;
  NodeIdentity identity_;
  PoseKeeper poses_;
  ChannelTable names_;
  Hub hub_;
  StatusReport status_;
  std::vector<std::unique_ptr<NodeIdentity>> link_identities_;  // of links with ids of their own
  KilobotControl kilobots_;  // outlives the links, and is outlived by no session
  std::vector<std::unique_ptr<Station>> stations_;
  Clients clients_;
  std::optional<Answerer> answerer_;           // none: reserved.report is off
  std::optional<PingAnswerer> ping_answerer_;  // the same
  std::optional<loop::Deferred> pings_;        // its answers, at the end of a turn
  MetricsFile metrics_;
  Capture capture_;
  Operator operator_;
  loop::Timer link_timer_;
  loop::Timer copy_timer_;
  loop::Timer report_timer_;
};

}  // namespace swarmtalk::daemon
