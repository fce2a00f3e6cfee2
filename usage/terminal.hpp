// Where a program's output goes: how wide it is, and whether it shows colours.
#pragma once

#include <cstddef>

namespace swarmtalk::usage {

/// Columns of the terminal behind a descriptor, at least 20; else $COLUMNS; 0: no terminal.
std::size_t columns(int fd);

/// A terminal that shows colours, whose user has not set $NO_COLOR.
bool has_colour(int fd);

}  // namespace swarmtalk::usage
