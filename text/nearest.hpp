// What a misspelt word may have been.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::text {

/// How many letters are to be changed, left out or added to make one of the other.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The word that is most like `word`; empty when none is near: at most 2 letters, or a quarter of
/// them, are to be changed, left out or added.
std::string nearest(const std::string& word, const std::vector<std::string>& known);

/// The same for the name of a channel, which is one of its own more often than a misspelt one:
/// short names differ by one letter, and those that differ in a number alone are meant to differ.
/// @param known  names in use; that of the channel itself does not count
std::string nearest_channel(const std::string& name, const std::vector<std::string>& known);

}  // namespace swarmtalk::text
