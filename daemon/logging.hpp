// Sets up spdlog: lines to stderr, fit for a terminal or for the journal.
#pragma once

#include <string>

namespace swarmtalk::daemon {

/// @param level  "trace", "debug", "info", "warning" or "error"
void start_logging(const std::string& level);

}  // namespace swarmtalk::daemon
