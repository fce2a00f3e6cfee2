// Fills the answer to GetStatus, and the daemon's Hello, from what the parts know.
#pragma once

#include <chrono>
#include <string>

#include "daemon/hub/hub.hpp"
#include "daemon/session/clients.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {

class StatusReport final : public StatusSource {
 public:
  /// All references must outlive this object.
  StatusReport(const Hub& hub, const PoseKeeper& poses, const NodeIdentity& identity,
               const DaemonCounters& counters, std::string config_file);

  /// Whose number the status tells.
  void set_clients(const Clients& clients) { clients_ = &clients; }
  /// Where the node id is from, for people.
  void set_node_id_source(const std::string& source) { node_id_source_ = source; }

  void fill_hello(ipc::Hello& hello) override;
  void fill_status(ipc::Status& status) override;
  /// At most kMostNeighbours, of the first links.
  void fill_neighbours(ipc::Neighbours& reply) override;

  static constexpr int kMostNeighbours = 400;  // of at most 150 bytes: one frame

 private:
  void fill_users(ipc::Status& status) const;
  void fill_links(ipc::Status& status) const;

  const Hub& hub_;
  const PoseKeeper& poses_;
  const NodeIdentity& identity_;
  const DaemonCounters& counters_;
  std::string config_file_;
  std::string node_id_source_;
  const Clients* clients_ = nullptr;
  std::chrono::steady_clock::time_point started_at_ = loop::now();
};

}  // namespace swarmtalk::daemon
