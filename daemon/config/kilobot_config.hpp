// How the keys of a [links.NAME] section of type "kilobot" are read. docs/kilobot.md explains them.
#pragma once

#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "frame/air_frame.hpp"

namespace swarmtalk::daemon {

class TableReader;

/// The keys of the section, "type" and "profile" too.
std::vector<std::string> kilobot_keys();

/// Checks the keys and reads all but "type" and "node_id".
/// @throws ConfigError
void read_kilobot(const TableReader& table, KilobotConfig& config, frame::ProfileId& profile);

}  // namespace swarmtalk::daemon
