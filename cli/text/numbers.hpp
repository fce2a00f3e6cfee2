// Numbers and names as JSON and as cells of a table.
#pragma once

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cli/text/hex.hpp"

namespace swarmtalk::cli {

/// Rounded to a thousandth; null if it is not finite.
inline nlohmann::ordered_json number_of(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::round(value * 1000) / 1000;
}

/// Of an even number of values the middle between the two in the middle; none: there are none.
inline std::optional<double> median(std::vector<double> values) {
  if (values.empty()) return std::nullopt;
  std::sort(values.begin(), values.end());
  return (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2;
}

/// Safe for a terminal.
inline std::string payload_name(const std::string& name) {
  return escaped(name).value_or(to_hex(name));
}

}  // namespace swarmtalk::cli
