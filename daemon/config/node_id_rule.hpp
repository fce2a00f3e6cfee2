// Where a node id comes from: a number, a random draw, the digits of the host's name, or the last
// number of an IP address, so that a hundred robots can share one configuration file.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"

namespace swarmtalk::daemon {

/// An IPv4 address of this machine.
struct HostAddress {
  std::string interface;
  std::uint32_t address = 0;  // host byte order
  bool is_up = true;          // the interface is switched on
};

/// What the rules look at.
struct Host {
  std::string name;
  std::vector<HostAddress> addresses;  // without loopback, in any order
};

/// This machine as it is now.
Host look_at_host();

/// "auto", "hostname", "ip", or a number from 1 to 65534.
/// @return what is wrong with `text` and the remedy; empty: nothing, and `node` is changed
std::string read_node_id_rule(const std::string& text, NodeConfig& node);

/// Applies the rule: sets `id` and `id_source`.
/// @param look  asked only if the rule needs to know; the order of the addresses is of no matter
/// @throws ConfigError  the host's name has no number, no such address or several, out of range;
///   `node` is not changed
void resolve_node_id(NodeConfig& node, const KeyLines& lines,
                     const std::function<Host()>& look = look_at_host);

}  // namespace swarmtalk::daemon
