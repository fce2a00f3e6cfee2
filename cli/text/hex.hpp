// Bytes as text that a terminal can show: as digits (hex/digits.hpp), or escaped.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hex/digits.hpp"

namespace swarmtalk::cli {

using hex::from_hex;
using hex::to_hex;

/// Safe for a terminal (text/plain.hpp), with a backslash as two, so that it can be read back.
/// @return nullopt if it is not UTF-8
std::optional<std::string> escaped(std::string_view bytes);

}  // namespace swarmtalk::cli
