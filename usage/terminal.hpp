// Where a program's output goes: how wide it is, whether it shows colours, and text in lines that
// fit.
#pragma once

#include <cstddef>
#include <string>

namespace swarmtalk::usage {

/// Columns of the terminal behind a descriptor, at least 20; else $COLUMNS; 0: no terminal.
std::size_t columns(int fd);

/// A terminal that shows colours, whose user has not set $NO_COLOR.
bool has_colour(int fd);

/// Text in lines of at most `columns` characters; what is indented stays so.
std::string wrapped(const std::string& text, std::size_t columns);

/// The same for the terminal behind a descriptor; as it is where there is none.
std::string folded(const std::string& text, int fd);

}  // namespace swarmtalk::usage
