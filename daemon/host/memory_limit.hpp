// How much memory the system lets this process have.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace swarmtalk::daemon {

/// The least limit of its control groups (version 2 or 1). @return none: there is none
/// @param root  where the system's files are; another only for tests
std::optional<std::uint64_t> memory_limit_bytes(const std::string& root = "");

}  // namespace swarmtalk::daemon
