// Reads TOML for all programs, with one line for a person where it is wrong. The parser, toml++,
// has tables of characters beyond ASCII with undefined behaviour on some of them, and ends the
// program on some control characters: it gets ASCII only. TOML allows other characters in comments,
// which mean nothing, and in strings, where double quotes have an escape for each.
#pragma once

#include <string>
#include <string_view>

#include "text/toml.hpp"

namespace swarmtalk::text {

struct AsciiToml {
  std::string text;   // of the same meaning and lines, without comments
  unsigned line = 0;  // from 1: of the first character that must not be there; 0: there is none
  std::string what;   // its column, what it is, and the remedy
};

AsciiToml to_ascii(std::string_view text);

/// @param file  its name, for the error
/// @throws std::runtime_error  one line: file, line, what is wrong, the remedy
toml::table parse_toml(std::string_view text, const std::string& file);

/// @throws std::runtime_error  the same, or that it cannot be read
toml::table parse_toml_file(const std::string& path);

}  // namespace swarmtalk::text
