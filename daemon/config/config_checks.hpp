// What keys of different sections mean for each other: paths used twice, and keys that mean nothing
// beside the others. Used by config_parser only, when the command line's options have been applied.
#pragma once

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"

namespace swarmtalk::daemon {

/// Socket, pose socket and metrics have a path each, and none that of the socket's lock: each would
/// put its file in the place of the other's, and nobody could connect. @throws ConfigError
void check_paths(const KeyLines& lines, const Config& config);

/// No key of the file is without effect: who wrote it believes that it has one.
/// @param rule_of_file  of node.id, without a --node-id: what goes with either of the two is right
/// @throws ConfigError
void check_effects(const KeyLines& lines, const Config& config, NodeIdRule rule_of_file);

}  // namespace swarmtalk::daemon
