// Bytes as hexadecimal digits and back. Pure functions.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace swarmtalk::cli {

std::string to_hex(std::string_view bytes);

/// Digits in pairs; spaces, colons and a leading 0x are skipped. @return nullopt if it is no hex
std::optional<std::string> from_hex(std::string_view digits);

/// True for well-formed UTF-8 (RFC 3629: no surrogates, nothing above U+10FFFF, no overlong form).
bool is_utf8(std::string_view bytes);

/// True for UTF-8 without control characters: safe for a terminal.
bool is_printable(std::string_view bytes);

}  // namespace swarmtalk::cli
