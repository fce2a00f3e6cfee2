// Admission: whether a message can be sent at all: its size and TTL, whether a link is up, whether
// there is room, and how fast the reserved channels may go. What it refuses is counted and says
// what to do. On the daemon's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/common/token_bucket.hpp"
#include "daemon/config/config.hpp"
#include "daemon/hub/channel_registry.hpp"
#include "daemon/hub/channel_table.hpp"
#include "daemon/hub/shares.hpp"
#include "daemon/hub/station_list.hpp"

namespace swarmtalk::daemon {

class Admission {
 public:
  /// All references must outlive it.
  Admission(const StationList& stations, const ChannelRegistry& channels, const ChannelTable& names,
            const Shares& shares, DaemonCounters& counters)
      : stations_(stations),
        channels_(channels),
        names_(names),
        shares_(shares),
        counters_(counters) {}

  /// Which channels are reserved, and whether they are on. Again when names of channels change.
  /// @param how_to_change  the file, and what makes the change apply, for the user
  void set_reserved(const ReservedConfig& config, const std::string& how_to_change);

  /// Whether anybody may publish on the channel. @return why not
  std::optional<Refusal> check_reserved(std::uint16_t channel) const;
  static std::optional<Refusal> check_ttl(std::uint32_t ttl, const ChannelLimits& most);

  /// Takes a turn on a reserved channel. @param waiting  of all clients
  /// @return why the message cannot be taken on
  std::optional<Refusal> admit(const Publisher& publisher, const Channel& channel,
                               std::size_t size_bytes, std::uint32_t ttl, const Waiting& waiting);

 private:
  struct Reserved {
    const char* name;
    std::uint16_t number;
    bool is_on;
    std::uint32_t rate_hz;
    TokenBucket turns;
  };

  std::optional<Refusal> check(const Publisher& publisher, const Channel& channel,
                               std::size_t size_bytes, std::uint32_t ttl,
                               const Waiting& waiting) const;
  std::optional<Refusal> take_turn(std::uint16_t channel);
  std::optional<Refusal> check_up(const Channel& channel) const;
  Refusal over_mtu(const Channel& channel, std::size_t size_bytes) const;

  const StationList& stations_;
  const ChannelRegistry& channels_;
  const ChannelTable& names_;
  const Shares& shares_;
  DaemonCounters& counters_;
  std::vector<Reserved> reserved_;
  std::string how_to_change_;
};

}  // namespace swarmtalk::daemon
