// What `swarmtalk-lab status` shows: each robot of a lab and what its daemon says of itself.
#pragma once

#include "lab/state.hpp"

namespace swarmtalk::lab {

/// Prints one line per robot (or one JSON object) to standard output.
/// @return 0 when every daemon answers, else 1.
int print_status(State state, bool as_json);

}  // namespace swarmtalk::lab
