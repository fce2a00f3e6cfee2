// The [limits] section of the configuration. Used by config_parser only.
#pragma once

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "daemon/config/table_reader.hpp"

namespace swarmtalk::daemon {

/// @throws ConfigError
void read_limits(const TableReader& table, LimitsConfig& limits);

}  // namespace swarmtalk::daemon
