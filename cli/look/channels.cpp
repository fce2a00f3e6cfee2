#include <poll.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/looking.hpp"
#include "cli/look/air_watch.hpp"
#include "cli/text/columns.hpp"
#include "cli/text/format.hpp"
#include "cli/text/numbers.hpp"
#include "cli/text/table.hpp"
#include "text/counted.hpp"

namespace swarmtalk::cli {
namespace {

std::string rate_text(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value < 10 ? "%.1f" : "%.0f", value);
  return text;
}

Json channel_json(std::uint16_t number, const ChannelStatus* here, const AirChannel* air,
                  double listened_s) {
  Json json{
      {"number", number},
      {"name", here != nullptr && !here->name.empty() ? Json(here->name) : Json(nullptr)},
      {"publishers_here", here != nullptr ? here->publishers : 0},
      {"subscribers_here", here != nullptr ? here->subscribers : 0},
      {"timestamped", air != nullptr ? air->is_timestamped : here != nullptr && here->timestamped},
      {"on_air", Json::array()}};
  if (air == nullptr) return json;
  for (const auto& [node, from] : air->publishers) {
    json["on_air"].push_back(
        {{"node_id", node},
         {"this_robot", from.is_own},
         {"heard_itself", from.is_heard},
         {"messages_per_s", number_of(static_cast<double>(from.messages) / listened_s)},
         {"bytes_per_s", number_of(static_cast<double>(from.bytes) / listened_s)}});
  }
  return json;
}

std::vector<std::string> row_of(const Json& channel) {
  double messages = 0;
  double bytes = 0;
  std::string robots;
  for (const Json& from : channel["on_air"]) {
    messages += from["messages_per_s"].get<double>();
    bytes += from["bytes_per_s"].get<double>();
    robots += (robots.empty() ? "" : " ") + from["node_id"].dump() +
              (from["this_robot"].get<bool>() ? "*" : "") +
              (from["heard_itself"].get<bool>() ? "" : "+");
  }
  return {channel["name"].is_null() ? "-" : payload_name(channel["name"].get<std::string>()),
          channel["number"].dump(),
          rate_text(messages),
          rate_text(bytes),
          channel["publishers_here"].dump(),
          channel["subscribers_here"].dump(),
          robots.empty() ? "-" : robots};
}

/// What the figures leave out, on stderr.
void say_what_is_left_out(const AirWatch& air, bool is_json) {
  if (air.unlisted_packets() > 0) {
    fail("more than " + std::to_string(AirWatch::kMaxPublishers) +
         " publishers were heard; of the others " +
         text::counted(air.unlisted_packets(), "packet is", "packets are") + " not counted");
  }
  if (is_json) return;  // its keys say the rest
  if (air.missed_frames() > 0) {
    fail(text::counted(air.missed_frames(), "frame was", "frames were") +
         " not looked at: this program was too slow for all that is on the air");
  }
  if (air.sealed_frames() > 0) {
    fail(text::counted(air.sealed_frames(), "frame was", "frames were") +
         " sealed with a swarm key; their channels cannot be seen");
  }
}

}  // namespace

int channels(const Common& common, const ChannelsArguments& arguments) {
  Client client = make_client(common);
  if (const Status status = client.connect(); !status) return fail(status);
  interrupt_on_signals();
  AirWatch air(common.socket_path);
  if (const Status status = air.open(); !status) return fail(status);
  const auto start = Clock::now();
  const auto end = after(start, seconds(arguments.seconds));
  do {  // what has come by now is looked at, however short the time is
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd descriptor{air.fd(), POLLIN, 0};
    ::poll(&descriptor, 1, static_cast<int>(std::clamp<std::int64_t>(left, 0, 3'600'000)));
    if (const Status status = air.look(); !status) return fail(status);
  } while (caught_signal() == 0 && Clock::now() < end);
  const double listened_s = std::chrono::duration<double>(Clock::now() - start).count();
  DaemonStatus daemon;
  if (const Status status = client.get_status(daemon); !status) return fail(status);
  std::map<std::uint16_t, std::pair<const ChannelStatus*, const AirChannel*>> all;
  for (const ChannelStatus& channel : daemon.channels) all[channel.number].first = &channel;
  for (const auto& [number, channel] : air.channels()) all[number].second = &channel;
  Json list = Json::array();
  for (const auto& [number, both] : all) {
    list.push_back(channel_json(number, both.first, both.second, listened_s));
  }
  if (common.is_json) {
    say_what_is_left_out(air, true);
    return print(Json{{"seconds", number_of(listened_s)},
                      {"frames", air.frames()},
                      {"sealed_frames", air.sealed_frames()},
                      {"missed_frames", air.missed_frames()},
                      {"channels", list}}
                     .dump() +
                 "\n");
  }
  std::vector<std::vector<std::string>> rows{
      {"CHANNEL", "NUMBER", "MSG/S", "BYTES/S", "PUBLISHERS HERE", "SUBSCRIBERS", "ROBOTS"}};
  for (const Json& each : list) rows.push_back(row_of(each));
  const Look look = look_of_output();
  std::string text;
  bool is_too_wide = false;
  for (const std::string& line : columns(rows, "lrrrrrl")) {
    text += line + "\n";
    is_too_wide = is_too_wide || (look.columns != 0 && width_of(line) > look.columns);
  }
  if (is_too_wide) text = table(rows, look);  // a block for each
  if (list.empty()) {
    text = folded(
        "no channel is in use here, and none was heard in " + rate_text(listened_s) + " s\n", look);
  }
  const auto has_sign = [](const auto& row) {
    return row.back().find_first_of("*+") != std::string::npos;
  };
  if (std::any_of(rows.begin(), rows.end(), has_sign)) {
    text += folded("\n*: this robot. +: not heard itself, others pass its messages on.\n", look);
  }
  const int printed = print(text);
  say_what_is_left_out(air, false);
  return caught_signal() == 0 ? printed : kExitSignal + caught_signal();
}

}  // namespace swarmtalk::cli
