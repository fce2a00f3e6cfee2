// Where the cycles of a call go: by function, alone and with all that it calls, and by source line.
// Asks avr-nm and avr-addr2line for the names.
#pragma once

#include <string>

#include "tests/avr/emulated_node.hpp"

namespace swarmtalk::avr {

/// Prints the profile of the story's worst receive or pull. Throws std::runtime_error without the
/// two programs.
void print_profile(EmulatedNode& node, const std::string& image, const Story& story, bool is_pull);

}  // namespace swarmtalk::avr
