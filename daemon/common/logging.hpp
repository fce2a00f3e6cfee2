// Sets up spdlog: lines to stderr, fit for a terminal or for the journal. Each part of the daemon
// (subsystem) has a logger of its own name, whose level can be changed while the daemon runs.
#pragma once

#include <spdlog/logger.h>

#include <array>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::daemon {

inline constexpr std::array<const char*, 4> kSubsystems{"daemon", "client", "hub", "link"};
inline constexpr std::array<const char*, 5> kLogLevels{"trace", "debug", "info", "warning",
                                                       "error"};

/// @param level  one of kLogLevels, of every subsystem that `levels` (by subsystem) does not name
void start_logging(const std::string& level, const std::map<std::string, std::string>& levels = {});

/// The logger of a subsystem; before start_logging() one made from spdlog's default.
std::shared_ptr<spdlog::logger> log_of(const char* subsystem);

/// @param subsystem  one of kSubsystems; empty: all
/// @return false, and nothing changed: no such subsystem or level
bool set_log_level(std::string_view subsystem, std::string_view level);

/// Subsystem and its level now, in the order of kSubsystems.
std::vector<std::pair<std::string, std::string>> log_levels();

}  // namespace swarmtalk::daemon
