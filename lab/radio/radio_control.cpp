#include "lab/radio/radio_control.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <vector>

namespace swarmtalk::lab::radio {
namespace {

using nlohmann::json;
using sim::Fault;
using sim::WifiAir;

constexpr double kFarthestM = 100000;  // beyond it a place is a mistake

uint32_t robot_from(const WifiAir& air, const json& number) {
  const auto robot = number.get<std::int64_t>();
  if (robot < 1 || robot > air.size()) {
    throw std::runtime_error("there is no robot " + std::to_string(robot) + "; robots are 1 to " +
                             std::to_string(air.size()));
  }
  return static_cast<uint32_t>(robot - 1);
}

double length_mm(const json& request, const char* key) {
  const double metres = request.at(key).get<double>();
  if (!(std::fabs(metres) <= kFarthestM)) {
    throw std::runtime_error(std::string(key) + " is beyond 100 km");
  }
  return metres * 1000;
}

json losses_of(const sim::WifiAirCounters& counters) {
  json losses = {{"queue_full", counters.lost_queue_full}};
  for (const sim::WifiAirLoss& loss : sim::wifi_air_losses()) {
    losses[loss.name] = counters.*loss.count;
  }
  return losses;
}

json counts_of(const sim::WifiAirCounters& counters) {
  return {{"offered", counters.offered},   {"sent", counters.sent},
          {"deferred", counters.deferred}, {"expected", counters.expected},
          {"received", counters.received}, {"air_us", counters.air_us},
          {"lost", losses_of(counters)}};
}

json interference_of(WifiAir& air) {
  json lines = json::array();
  json jammers = json::array();
  for (const Fault& fault : air.interference().active()) {
    if (fault.kind == Fault::Kind::kPartition) {
      lines.push_back(fault.x_mm / 1000);
    } else {
      jammers.push_back({{"x_m", fault.x_mm / 1000},
                         {"y_m", fault.y_mm / 1000},
                         {"radius_m", fault.radius_mm / 1000}});
    }
  }
  return {{"lines_x_m", lines}, {"jammers", jammers}};
}

/// @param real    so many are robots of the lab; those behind them are ghosts
/// @param ghosts  numbers of those who are there
json robots_of(const WifiAir& air, uint32_t real, const json& ghosts) {
  json robots = json::array();
  for (uint32_t station = 0; station < air.size(); ++station) {
    const bool is_ghost = station >= real;
    if (is_ghost && std::find(ghosts.begin(), ghosts.end(), station + 1) == ghosts.end()) continue;
    int neighbours = 0;
    for (uint32_t other = 0; other < air.size(); ++other) {
      neighbours += other != station && air.is_in_range(other, station);
    }
    json robot = counts_of(air.counters(station));
    robot["robot"] = station + 1;
    robot["ghost"] = is_ghost;
    robot["x_m"] = air.body(station).x_mm / 1000;
    robot["y_m"] = air.body(station).y_mm / 1000;
    robot["in_range"] = neighbours;
    robot["part"] = air.group(station);
    robots.push_back(robot);
  }
  return robots;
}

json status_of(WifiAir& air, const json& process) {
  json links = json::array();
  for (const auto& [ends, loss] : air.link_losses()) {
    links.push_back({{"from", ends.first + 1}, {"to", ends.second + 1}, {"loss", loss}});
  }
  json status = process;
  status["range_m"] = air.config().range_mm / 1000;
  status["rate_mbps"] = air.config().rate_mbps;
  status["loss"] = air.config().loss;
  status["seconds"] = static_cast<double>(air.now_us()) * 1e-6;
  status["links"] = links;
  status.update(interference_of(air));
  json counts = counts_of(air.counters());
  counts["lost"].update(process.at("lost"));
  status.update(counts);
  status["robots"] =
      robots_of(air, process.value("real", air.size()), process.value("ghosts", json::array()));
  return status;
}

json set_link(WifiAir& air, const json& request) {
  const uint32_t from = robot_from(air, request.at("from"));
  const uint32_t to = robot_from(air, request.at("to"));
  if (from == to) throw std::runtime_error("a robot has no link to itself; name two");
  if (request.contains("loss")) {
    const json& loss = request["loss"];
    if (loss.is_null()) {
      air.set_link_loss(from, to, std::nullopt);
    } else {
      const double share = loss.get<double>();
      if (!(share >= 0 && share <= 1)) throw std::runtime_error("loss is a share: 0 to 1");
      air.set_link_loss(from, to, share);
    }
  }
  return {{"from", from + 1},
          {"to", to + 1},
          {"margin_db", air.margin_db(from, to)},
          {"in_range", air.is_in_range(from, to)},
          {"loss", air.link_loss(from, to).value_or(air.config().loss)}};
}

json move(WifiAir& air, const json& request) {
  const uint32_t robot = robot_from(air, request.at("robot"));
  air.move(robot, length_mm(request, "x_m"), length_mm(request, "y_m"));
  return json::object();
}

void begin(WifiAir& air, const Fault& fault) {
  if (air.interference().active().size() >= kMostFaults) {
    throw std::runtime_error("there are " + std::to_string(kMostFaults) +
                             " lines and jammers already; end some (heal, unjam)");
  }
  air.interference().begin(fault);
}

json part(WifiAir& air, const json& request) {
  if (request.contains("x_m")) {
    Fault fault;
    fault.kind = Fault::Kind::kPartition;
    fault.end_us = UINT64_MAX;
    fault.x_mm = length_mm(request, "x_m");
    begin(air, fault);
    return json::object();
  }
  std::vector<uint32_t> robots;
  for (const json& number : request.at("robots")) robots.push_back(robot_from(air, number));
  uint32_t last = 0;
  for (uint32_t station = 0; station < air.size(); ++station) {
    last = std::max(last, air.group(station));
  }
  for (const uint32_t robot : robots) air.set_group(robot, last + 1);
  return {{"part", last + 1}};
}

json heal(WifiAir& air) {
  air.interference().end(Fault::Kind::kPartition);
  for (uint32_t station = 0; station < air.size(); ++station) air.set_group(station, 0);
  return json::object();
}

json jam(WifiAir& air, const json& request) {
  Fault fault;
  fault.kind = Fault::Kind::kJam;
  fault.end_us = UINT64_MAX;
  fault.x_mm = length_mm(request, "x_m");
  fault.y_mm = length_mm(request, "y_m");
  fault.radius_mm = length_mm(request, "radius_m");
  if (!(fault.radius_mm > 0)) throw std::runtime_error("the radius of a jammer is above 0 m");
  begin(air, fault);
  return json::object();
}

json carry_out(WifiAir& air, const json& status, const json& request) {
  const auto what = request.at("do").get<std::string>();
  if (what == "status") return status_of(air, status);
  if (what == "link") return set_link(air, request);
  if (what == "move") return move(air, request);
  if (what == "part") return part(air, request);
  if (what == "heal") return heal(air);
  if (what == "jam") return jam(air, request);
  if (what == "unjam") {
    air.interference().end(Fault::Kind::kJam);
    return json::object();
  }
  throw std::runtime_error("the medium knows no request '" + what + "'");
}

}  // namespace

// What is not JSON is told without its bytes, which an answer could not hold.
std::string answer(WifiAir& air, const json& status, std::string_view request) {
  const json parsed = json::parse(request, nullptr, false);
  if (parsed.is_discarded()) return json{{"error", "a request that is not JSON"}}.dump();
  try {
    return carry_out(air, status, parsed).dump();
  } catch (const json::exception& error) {
    return json{{"error", std::string("a request that is none: ") + error.what()}}.dump();
  } catch (const std::exception& error) {
    return json{{"error", error.what()}}.dump();
  }
}

}  // namespace swarmtalk::lab::radio
