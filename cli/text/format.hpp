// How things look: lines for people, JSON with stable keys for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include <swarmtalk/client.hpp>

#include "cli/text/table.hpp"

namespace swarmtalk::cli {

using Json = nlohmann::ordered_json;

/// JSON in one line. Of what strangers said, bytes that are not UTF-8 are replaced by U+FFFD.
inline std::string json_text(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Metres or radians, rounded to a millionth so that float noise is not printed; null if unknown.
Json number(float value);
Json to_json(const std::optional<Pose>& pose);
Json to_json(const Loss& loss);
Json to_json(const std::string& channel, const Message& message);
Json to_json(const DaemonStatus& status);
Json to_json(const std::vector<Neighbour>& neighbours);

/// "0.50 m"; "unknown".
std::string metres(float value);
/// Degrees for people, whole ones, -180 to 180.
std::string degrees(float value_rad);
/// Text in quotes, escaped for a terminal; "hex 00ff" if it is not text; "(empty)".
std::string payload_text(std::string_view payload);
std::string to_line(const std::string& channel, const Message& message, const Look& look = {});
std::string to_line(const Pose& pose);
/// The robot's own pose and who told it; of one that is too old, how old it is, and the limit.
std::string pose_text(const DaemonStatus& status);
/// Several lines.
std::string to_text(const DaemonStatus& status, const Look& look = {});
/// One line for each, which fits a terminal of 80 columns.
/// @param is_whole  with addresses and poses
std::string to_text(const std::vector<Neighbour>& neighbours, const Look& look = {},
                    bool is_whole = false);
/// Where messages are lost: tables of channels and programs, and the counters. Several lines.
std::string to_stats(const DaemonStatus& status, const Look& look = {});
/// "2 on the air, 1 in the daemon".
std::string loss_text(const Loss& loss);

}  // namespace swarmtalk::cli
