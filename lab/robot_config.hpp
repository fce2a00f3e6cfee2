// Writes the configuration of one robot's daemon.
#pragma once

#include <string>

#include "lab/state.hpp"

namespace swarmtalk::lab {

/// TOML text: `base_config` (a file's path, or empty: as installed) with this robot's socket, pose,
/// node id and link put in. Throws std::runtime_error with one line when the file is not TOML.
std::string robot_config(const State& state, const Robot& robot, const std::string& base_config);

}  // namespace swarmtalk::lab
