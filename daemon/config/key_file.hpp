// Reads a swarm key from its file, and refuses one that others on this machine could have read.
#pragma once

#include <memory>
#include <string>

#include "frame/swarm_key.hpp"

namespace swarmtalk::daemon {

/// @param path  a file of 64 hexadecimal digits (`swarmtalk-cli keygen` makes one), mode 0600 or
///   less, owned by root or by this process's user
/// @throws std::runtime_error  one sentence with the remedy, beginning with the path
std::shared_ptr<const frame::SwarmKey> load_key(const std::string& path);

}  // namespace swarmtalk::daemon
