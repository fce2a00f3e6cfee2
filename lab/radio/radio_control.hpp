// What the radio medium does when it is told to while it runs: one JSON object is a request, one is
// its answer ({"error": "..."} if it cannot). Robots are numbered from 1, lengths are in m. Called
// by the medium's process only.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "sim/wifi_air.hpp"

namespace swarmtalk::lab::radio {

/// Lines and jammers at a time: each costs something for each frame.
inline constexpr std::size_t kMostFaults = 256;

/// Requests ("do"): "status"; "link" (from, to, and loss or null: as all); "move" (robot, x_m,
/// y_m); "part" (robots: they hear only each other) or (x_m: nothing crosses this line); "heal";
/// "jam" (x_m, y_m, radius_m); "unjam".
/// @param status  of the process; the answer to "status" is this and what the air says of itself
/// @return JSON in one line, whatever bytes the request has
std::string answer(sim::WifiAir& air, const nlohmann::json& status, std::string_view request);

}  // namespace swarmtalk::lab::radio
