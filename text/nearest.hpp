// What a misspelt word may have been.
#pragma once

#include <string>
#include <vector>

namespace swarmtalk::text {

/// The word that is most like `word`; empty when none is near: in a word of up to 5 letters one
/// letter, in a longer one two may be changed, left out, added or swapped with the next, and in any
/// word less than half of them. A far suggestion is worse than none.
std::string nearest(const std::string& word, const std::vector<std::string>& known);

/// The same for the name of a channel, which is one of its own more often than a misspelt one:
/// those that differ in a number alone are meant to differ.
/// @param known  names in use; that of the channel itself does not count
std::string nearest_channel(const std::string& name, const std::vector<std::string>& known);

}  // namespace swarmtalk::text
