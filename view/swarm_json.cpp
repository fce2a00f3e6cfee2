#include "view/swarm_json.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "hex/digits.hpp"
#include "view/playback.hpp"

namespace swarmtalk::view {
namespace {

using Json = nlohmann::json;

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::int64_t age_ms(Time now, Time at) {
  const auto age = std::chrono::duration_cast<std::chrono::milliseconds>(now - at).count();
  return std::max<std::int64_t>(age, 0);
}

/// Millimetres, or thousandths: more digits are noise, and cost bytes.
double rounded(double value) {
  return std::round(value * 1000.0) / 1000.0;
}

void put_known(Json& json, const char* key, float value) {
  if (!std::isnan(value)) json[key] = rounded(static_cast<double>(value));
}

Json loss_json(const Loss& lost) {
  return {{"air", lost.air},
          {"kernel", lost.kernel},
          {"daemon", lost.daemon},
          {"client", lost.client},
          {"late", lost.late}};
}

void put_place(Json& json, const SwarmRobot& robot, Time now) {
  if (!robot.place) return;
  json["x"] = rounded(static_cast<double>(robot.place->x_m));
  json["y"] = rounded(static_cast<double>(robot.place->y_m));
  json["th"] = rounded(static_cast<double>(robot.place->theta_rad));
  json["pose_age"] = age_ms(now, robot.place->at);
}

/// "#ff8000"
bool is_colour(const std::string& text) {
  return text.size() == 7 && text[0] == '#' &&
         text.find_first_not_of("0123456789abcdef", 1) == std::string::npos;
}

Json robot_json(const SwarmRobot& robot, Time now) {
  Json json{{"id", robot.id}};
  put_place(json, robot, now);
  if (robot.is_self) json["self"] = true;
  if (robot.heard_at) json["heard_age"] = age_ms(now, *robot.heard_at);
  if (robot.told_at) json["told_age"] = age_ms(now, *robot.told_at);
  if (robot.has_namesake) json["twin"] = true;
  if (robot.is_ghost) json["ghost"] = true;
  if (!robot.name.empty()) json["name"] = robot.name;
  if (const auto led = robot.values.find("led"); led != robot.values.end()) {
    if (is_colour(led->second)) json["led"] = led->second;
  }
  return json;
}

Json swarm_state(const Swarm& swarm, Time now) {
  Json robots = Json::array();
  Json links = Json::array();
  for (const auto& [id, robot] : swarm.robots()) {
    robots.push_back(robot_json(robot, now));
    for (const auto& [heard, hearing] : robot.hears) {
      links.push_back(
          {heard, id, rounded(static_cast<double>(hearing.loss)), age_ms(now, hearing.at)});
    }
  }
  Json json{{"t", "state"}, {"self", swarm.self()}, {"robots", robots}, {"links", links}};
  if (swarm.left_out() != 0) json["left_out"] = swarm.left_out();
  return json;
}

Json traffic_list(const Traffic& traffic, Time now) {
  Json channels = Json::array();
  for (const auto& [number, channel] : traffic.channels()) {
    Json json{{"n", number},
              {"name", channel.name},
              {"rate", rounded(channel.rate.per_second(now))},
              {"messages", channel.messages},
              {"bytes", channel.bytes},
              {"publishers", channel.publishers},
              {"subscribers", channel.subscribers},
              {"lost", loss_json(channel.lost)}};
    if (channel.last) json["age"] = age_ms(now, *channel.last);
    Json senders = Json::array();
    for (const auto& [id, at] : channel.senders) senders.push_back({id, age_ms(now, at)});
    json["senders"] = senders;
    channels.push_back(std::move(json));
  }
  return channels;
}

/// Channels that robots report to publish on, and that are not in the list: nobody here listens.
void add_reported(const Swarm& swarm, const Traffic& traffic, Json& channels) {
  std::map<std::uint16_t, unsigned> publishing;
  for (const auto& [id, robot] : swarm.robots()) {
    for (const auto& [number, use] : robot.channels) {
      if (use.publishers > 0 && !traffic.channels().contains(number)) ++publishing[number];
    }
  }
  for (const auto& [number, robots] : publishing) {
    channels.push_back({{"n", number}, {"name", ""}, {"publishing", robots}});
  }
}

}  // namespace

std::string swarm_state_json(const Swarm& swarm, Time now) {
  return text_of(swarm_state(swarm, now));
}

std::string state_json(Source& source) {
  const Time now = source.now();
  Json json = swarm_state(source.swarm(), now);
  if (const auto lost_at = source.lost_daemon_at()) json["no_daemon_age"] = age_ms(now, *lost_at);
  if (const Playback* const playback = source.playback()) {
    json["play"] = {{"at", playback->at().count()},
                    {"since", playback->known_since().count()},
                    {"playing", playback->is_playing()},
                    {"speed", playback->speed()}};
  }
  return text_of(json);
}

std::string info_json(const Source& source) {
  const DaemonStatus& status = source.status();
  const Status questions = source.questions();
  Json channels = traffic_list(source.traffic(), source.now());
  add_reported(source.swarm(), source.traffic(), channels);
  Json links = Json::array();
  for (const LinkStatus& link : status.links) {
    links.push_back({{"name", link.name},
                     {"type", link.type},
                     {"device", link.device},
                     {"profile", link.profile},
                     {"up", link.up},
                     {"state", link.state}});
  }
  return text_of({{"t", "info"},
                  {"daemon", source.daemon_name()},
                  {"uptime_ms", status.uptime.count()},
                  {"links", links},
                  {"questions", questions ? "" : std::string(questions.text())},
                  {"channels", channels},
                  {"left_out", source.left_out()}});
}

std::string card_json(const Swarm& swarm, std::uint32_t id, Time now) {
  const SwarmRobot* const robot = swarm.find(id);
  if (robot == nullptr) return text_of({{"t", "card"}, {"id", id}, {"known", false}});
  Json json = robot_json(*robot, now);
  json["t"] = "card";
  json["known"] = true;
  if (robot->epoch != 0) json["epoch"] = robot->epoch;
  if (!robot->link.empty()) json["link"] = robot->link;
  if (!robot->address.empty()) json["address"] = robot->address;
  put_known(json, "distance", robot->distance_m);
  put_known(json, "bearing", robot->bearing_rad);
  if (robot->frames != 0) {
    json["frames"] = robot->frames;
    json["frames_lost"] = robot->frames_lost;
  }
  if (!robot->values.empty()) json["values"] = robot->values;
  if (robot->programs) json["programs"] = *robot->programs;
  if (robot->lost) json["lost"] = loss_json(*robot->lost);
  Json rates = Json::array();
  for (const auto& [number, use] : robot->channels) {
    rates.push_back({number, use.publishers, use.subscribers, use.received_per_10s / 10.0});
  }
  if (!rates.empty()) json["channels"] = rates;
  return text_of(json);
}

namespace {

Json message_of(const HeardMessage& message) {
  Json json{{"t", "msg"},
            {"k", message.number},
            {"n", message.channel},
            {"from", message.sender},
            {"hex", hex::to_hex(message.payload)}};
  if (message.unknown_bytes != 0) json["size"] = message.unknown_bytes;
  if (message.hops != Message::kHopsUnknown) json["hops"] = message.hops;
  if (message.transmitter != 0 && message.transmitter != message.sender) {
    json["via"] = message.transmitter;
  }
  if (message.is_local) json["local"] = true;
  put_known(json, "d", message.distance_m);
  put_known(json, "b", message.bearing_rad);
  if (message.lost_before) json["lost"] = message.lost_before.total();
  return json;
}

}  // namespace

std::string message_json(const HeardMessage& message) {
  return text_of(message_of(message));
}

std::string messages_json(const std::deque<HeardMessage>& messages) {
  Json list = Json::array();
  for (const HeardMessage& each : messages) list.push_back(message_of(each));
  return text_of({{"t", "msgs"}, {"list", std::move(list)}});
}

std::string line_json(const LogLine& line, Time now) {
  return text_of({{"t", "log"},
                  {"k", line.number},
                  {"from", line.robot},
                  {"text", line.text},
                  {"age", age_ms(now, line.at)}});
}

std::string notice_json(const std::string& text) {
  return text_of({{"t", "notice"}, {"text", text}});
}

std::string dropped_json(std::uint64_t events, std::uint64_t states) {
  return text_of({{"t", "dropped"}, {"events", events}, {"states", states}});
}

std::string hello_json(Source& source, bool may_operate) {
  Json json{{"t", "hello"}, {"version", 1}, {"operate", may_operate}};
  if (const Playback* const playback = source.playback()) {
    const auto at_ns = static_cast<std::int64_t>(source.wall_ns());
    json["recording"] = {{"file", playback->file()},
                         {"begin", at_ns / 1'000'000 - playback->at().count()},
                         {"length", playback->length().count()},
                         {"problem", playback->problem()},
                         {"bars", playback->bars()}};
  }
  return text_of(json);
}

std::string jump_json(Source& source) {
  Json json{{"t", "jump"}, {"at", 0}, {"trail", Json::array()}};
  if (const Playback* const playback = source.playback()) {
    json["at"] = playback->at().count();
    for (const Playback::Step& step : playback->trail()) {
      Json spots = Json::array();
      for (const Playback::Spot& spot : step.spots) {
        spots.push_back({spot.robot, rounded(static_cast<double>(spot.x_m)),
                         rounded(static_cast<double>(spot.y_m))});
      }
      json["trail"].push_back({step.at.count(), std::move(spots)});
    }
  }
  return text_of(json);
}

}  // namespace swarmtalk::view
