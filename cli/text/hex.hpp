// Bytes as hexadecimal digits and back, and as text that a terminal can show. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace swarmtalk::cli {

std::string to_hex(std::string_view bytes);

/// Digits in pairs; spaces, colons and a leading 0x are skipped. @return nullopt if it is not hex
std::optional<std::string> from_hex(std::string_view digits);

/// Safe for a terminal (text/plain.hpp), with a backslash as two, so that it can be read back.
/// @return nullopt if it is not UTF-8
std::optional<std::string> escaped(std::string_view bytes);

}  // namespace swarmtalk::cli
