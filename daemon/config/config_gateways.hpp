// The parts of the configuration where links meet: [[gateway]] rules, and what the small profiles
// of some links mean for channel numbers and node ids. Used by config_parser only, after it has
// read links and channels.
#pragma once

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "daemon/config/table_reader.hpp"

namespace swarmtalk::daemon {

/// Fills config.gateways, and marks the links that rules copy to. @throws ConfigError
void read_gateways(const TableReader& root, KeyLines& lines, Config& config);

/// Every number under [channels] exists on some link. @throws ConfigError
void check_channels(const TableReader& root, KeyLines& lines, const Config& config);

/// Every link has a node id that its packets have room for, and gateways' links one that says so
/// where packets cannot. @throws ConfigError
void check_node_ids(const KeyLines& lines, const Config& config);

/// The ids from which a link without one draws its own. None: it speaks under the daemon's.
struct OwnIds {
  std::uint16_t least;
  std::uint16_t most;
};
std::optional<OwnIds> own_ids(const Config& config, const LinkConfig& link);

}  // namespace swarmtalk::daemon
