// Looks at TOML before the parser does. TOML allows no control characters, and characters beyond
// ASCII in strings and comments only; the parser of Debian 12 (toml++ 3.3) ends the program, or has
// undefined behaviour, on some of them instead of refusing them.
#pragma once

#include <string_view>

namespace swarmtalk::daemon {

struct StrayCharacter {
  unsigned line = 0;      // from 1; 0: there is none
  const char* what = "";  // what it is, and the remedy
};

/// The first character that must not be where it is.
StrayCharacter find_stray_character(std::string_view text);

}  // namespace swarmtalk::daemon
