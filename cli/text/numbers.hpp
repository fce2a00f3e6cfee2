// Numbers and names as JSON and as cells of a table.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "cli/text/hex.hpp"

namespace swarmtalk::cli {

/// Rounded to a thousandth; null if it is not finite.
inline nlohmann::ordered_json number_of(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(value * 1000) / 1000;
}

/// Safe for a terminal.
inline std::string payload_name(const std::string& name) {
  return escaped(name).value_or(to_hex(name));
}

}  // namespace swarmtalk::cli
