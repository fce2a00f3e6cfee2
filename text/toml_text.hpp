// Prepares TOML for the parser, toml++, whose tables of characters beyond ASCII have undefined
// behaviour on some of them, and which ends the program on some control characters: it gets ASCII
// only. TOML allows other characters in comments, which mean nothing, and in strings, where double
// quotes have an escape for each.
#pragma once

#include <string>
#include <string_view>

namespace swarmtalk::text {

struct AsciiToml {
  std::string text;   // of the same meaning and lines, without comments
  unsigned line = 0;  // from 1: of the first character that must not be there; 0: there is none
  std::string what;   // its column, what it is, and the remedy
};

AsciiToml to_ascii(std::string_view text);

/// The text of a file as to_ascii() has it.
/// @throws std::runtime_error  one line: it cannot be read, or what must not be there
std::string ascii_of_file(const std::string& path);

}  // namespace swarmtalk::text
