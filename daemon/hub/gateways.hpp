// Gateways: the rules by which messages are copied to another link, and what keeps them from going
// round in circles: a copy is marked as having crossed and never crosses again; where packets have
// no bit for that, gateways send under node ids of their own. On the daemon's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/config/config.hpp"
#include "daemon/hub/channel_registry.hpp"
#include "daemon/hub/outbox.hpp"
#include "daemon/hub/seen_messages.hpp"
#include "daemon/hub/station_list.hpp"
#include "daemon/station/node_identity.hpp"

namespace swarmtalk::daemon {

class Gateways {
 public:
  /// All references must outlive it.
  Gateways(const StationList& stations, ChannelRegistry& channels, Outbox& outbox,
           const NodeIdentity& identity, DaemonCounters& counters)
      : stations_(stations),
        channels_(channels),
        outbox_(outbox),
        identity_(identity),
        counters_(counters) {}

  /// Once. Opens the channels of the rules for good. @return what is impossible; none: done
  std::optional<Refusal> set_rules(std::vector<GatewayRule> rules);

  /// Whether a message that a station hands up has come by another way before; that is counted.
  bool came_otherwise(std::size_t station, const MessageHead& head,
                      std::span<const std::uint8_t> payload);

  /// Copies a received message to where the rules say.
  void cross(std::size_t station, const MessageHead& head, std::span<const std::uint8_t> payload);

  /// The same for one of our own programs. @param number  that it has on the air
  void cross_own(const Publication& publication, const Channel& channel, std::uint32_t number);

 private:
  void copy(const GatewayRule& rule, GatewayOrigin origin, std::span<const std::uint8_t> payload,
            std::uint8_t ttl);

  const StationList& stations_;
  ChannelRegistry& channels_;
  Outbox& outbox_;
  const NodeIdentity& identity_;  // the daemon's
  DaemonCounters& counters_;
  std::vector<GatewayRule> rules_;
  SeenMessages seen_;
};

}  // namespace swarmtalk::daemon
