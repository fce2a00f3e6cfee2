// The map of a lab: swarmtalk-view beside a robot's daemon, on this machine's own network, where a
// browser reaches it.
#pragma once

#include <string>
#include <vector>

#include "lab/state.hpp"

namespace swarmtalk::lab {

/// Path of swarmtalk-view: beside this program, in the build folder or in PATH; empty: there is
/// none.
std::string find_view();

/// Runs swarmtalk-view for this robot until it ends, prints what it prints, and opens its page in a
/// browser where this user has a screen.
/// @param options  of swarmtalk-view; none: its usual port, or a free one where that is taken
/// @return its exit code. Throws std::runtime_error with one line when it cannot be run
int show_map(const State& state, const Robot& robot, const std::vector<std::string>& options);

}  // namespace swarmtalk::lab
