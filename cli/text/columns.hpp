// Text that fits into a terminal's width: tables whose last columns give way, and cut lines. Widths
// are counted in characters, not bytes. Pure functions.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::cli {

inline constexpr std::size_t kAnyWidth = 100000;

std::size_t width_of(std::string_view text);

/// At most `width` characters; one that is cut ends with ~.
std::string clip(std::string_view text, std::size_t width);

/// @param rows  the first is the head; each has as many cells
/// @param alignment  a letter a column: l or r
/// @param width  columns from the right that do not fit are left out, and the head ends with their
///   number, as in " +3"; the first is cut
std::vector<std::string> columns(const std::vector<std::vector<std::string>>& rows,
                                 std::string_view alignment, std::size_t width = kAnyWidth);

}  // namespace swarmtalk::cli
