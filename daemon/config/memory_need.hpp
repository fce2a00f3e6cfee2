// How much memory the daemon may come to need: what all clients together may make it hold, with the
// limits of a configuration. An estimate from above, for the one check at start.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "daemon/config/config.hpp"

namespace swarmtalk::daemon {

/// With every limit used up at once.
std::uint64_t most_memory_bytes(const Config& config);

/// @param limit_bytes  what the system gives this process
/// @return one line with the remedy: it is too little; none: it is enough
std::optional<std::string> memory_problem(const Config& config, std::uint64_t limit_bytes);

}  // namespace swarmtalk::daemon
