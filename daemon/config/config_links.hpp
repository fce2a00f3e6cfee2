// The [links.NAME] sections of the configuration. Used by config_parser only.
#pragma once

#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "daemon/config/table_reader.hpp"

namespace swarmtalk::daemon {

/// In the order of the file. @throws ConfigError
void read_links(const TableReader& root, KeyLines& lines, std::vector<LinkConfig>& links);

}  // namespace swarmtalk::daemon
