// Where a node id comes from: a number, a random draw, the digits of the host's name, or the last
// number of an IP address, so that a hundred robots can share one configuration file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"

namespace swarmtalk::daemon {

/// "auto", "hostname", "ip", or a number from 1 to 65534.
/// @return what is wrong with `text` and the remedy; empty: nothing, and `node` is changed
std::string read_node_id_rule(const std::string& text, NodeConfig& node);

/// Applies the rule. @return none: automatic
/// @throws ConfigError  the host's name has no digits, no such address, out of range
std::optional<std::uint16_t> resolve_node_id(const NodeConfig& node, const KeyLines& lines);

/// Last run of digits of a name: robot-07.lab gives 7. None: there is none, or it is too long.
std::optional<std::int64_t> number_in_hostname(const std::string& name);

}  // namespace swarmtalk::daemon
