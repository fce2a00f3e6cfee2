// Bytes as hexadecimal digits and back. Pure functions; a leaf.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace swarmtalk::hex {

/// Two digits of each byte, in lower case.
std::string to_hex(std::span<const std::uint8_t> bytes);
std::string to_hex(std::string_view bytes);

/// Digits in pairs; blanks, ends of lines, colons and a leading 0x are skipped.
/// @return nullopt if it is not hex
std::optional<std::string> from_hex(std::string_view digits);

}  // namespace swarmtalk::hex
