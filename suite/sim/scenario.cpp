#include "suite/sim/scenario.hpp"

#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <type_traits>

namespace swarmtalk::suite {
namespace {

using nlohmann::json;
constexpr double kMostSeconds = 1e6;

using Setters = std::map<std::string, std::function<void(const json&)>>;

template <class T>
std::function<void(const json&)> into(T& target) {
  return [&target](const json& value) {
    if constexpr (std::is_integral_v<T>) {
      const int64_t number = value.is_number_integer() ? value.get<int64_t>() : -1;
      if (!value.is_number_integer() || number < int64_t{std::numeric_limits<T>::min()} ||
          number > int64_t{std::numeric_limits<T>::max()}) {
        throw std::runtime_error("must be a whole number that fits");
      }
    } else if constexpr (std::is_floating_point_v<T>) {
      if (!value.is_number()) throw std::runtime_error("must be a number");
    }
    target = value.get<T>();
  };
}

void set_all(const json& section, const std::string& name, const Setters& setters) {
  for (const auto& [key, value] : section.items()) {
    const auto found = setters.find(key);
    if (found == setters.end()) {
      std::string known;
      for (const auto& [each, setter] : setters) known += " " + each;
      throw std::runtime_error("scenario: " + name + " has no key '" + key +
                               "'; there is:" + known);
    }
    try {
      found->second(value);
    } catch (const std::exception& error) {
      throw std::runtime_error("scenario: " + name + " " + key + ": " + error.what());
    }
  }
}

sim::Fault::Kind fault_kind(const std::string& name) {
  static const std::map<std::string, sim::Fault::Kind> kinds = {
      {"death", sim::Fault::Kind::kDeath},
      {"restart", sim::Fault::Kind::kRestart},
      {"clock_step", sim::Fault::Kind::kClockStep},
      {"partition", sim::Fault::Kind::kPartition},
      {"jam", sim::Fault::Kind::kJam}};
  const auto found = kinds.find(name);
  if (found == kinds.end()) {
    throw std::runtime_error("scenario: no fault '" + name +
                             "'; there is: death restart clock_step partition jam");
  }
  return found->second;
}

sim::Fault read_fault(const json& entry) {
  sim::Fault fault;
  std::string kind;
  double at_s = 0;
  double end_s = 1e9;
  set_all(entry, "fault",
          {{"kind", into(kind)},
           {"at_s", into(at_s)},
           {"end_s", into(end_s)},
           {"robot", into(fault.robot)},
           {"ticks", into(fault.ticks)},
           {"x_mm", into(fault.x_mm)},
           {"y_mm", into(fault.y_mm)},
           {"radius_mm", into(fault.radius_mm)}});
  fault.kind = fault_kind(kind);
  fault.at_us = static_cast<uint64_t>(at_s * 1e6);
  fault.end_us = static_cast<uint64_t>(end_s * 1e6);
  return fault;
}

NewsSettings read_message(const json& section) {
  NewsSettings news;
  uint32_t period_ms = 5000;
  uint32_t tellers = 0;  // who they are stands in the robots' roles
  set_all(section, "[message]",
          {{"bytes", into(news.bytes)},
           {"ttl", into(news.ttl)},
           {"copies", into(news.copies)},
           {"period_ms", into(period_ms)},
           {"tellers", into(tellers)}});
  if (news.bytes < 3 || news.bytes > kMostNewsBytes) {
    throw std::runtime_error("scenario: [message] bytes must be 3 to 64");
  }
  if (period_ms < 33 || period_ms > 1000000) {
    throw std::runtime_error("scenario: [message] period_ms must be 33 to 1000000");
  }
  news.period_ticks = static_cast<uint16_t>(uint64_t{period_ms} * 1000 / sim::kTickUs);
  return news;
}

}  // namespace

Scenario read_scenario(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!file || !std::getline(file, line)) throw std::runtime_error("cannot read " + path);
  Scenario scenario;
  scenario.text = json::parse(line);
  const json& text = scenario.text;
  scenario.program = text.at("program").get<std::string>();
  scenario.platform = text.at("platform").get<std::string>();
  scenario.seed = text.at("seed").get<uint64_t>();
  scenario.seconds = text.at("seconds").get<double>();
  if (!text.at("seed").is_number_unsigned()) {
    throw std::runtime_error("scenario: seed must be a whole number from 0 on");
  }
  if (!(scenario.seconds > 0 && scenario.seconds <= kMostSeconds)) {
    throw std::runtime_error("scenario: seconds must be above 0 and at most a million");
  }
  scenario.news = read_message(text.value("message", json::object()));
  scenario.has_random_ids = text.value("random_ids", false);
  for (const json& robot : text.at("robots")) {
    scenario.robots.push_back({robot.at("x_mm").get<double>(), robot.at("y_mm").get<double>(),
                               robot.value("theta_rad", 0.0), robot.value("role", 0)});
  }
  return scenario;
}

void apply(const Scenario& scenario, sim::RadioConfig& radio, sim::BodyConfig& body,
           sim::ClockConfig& clock, std::vector<sim::Fault>& faults) {
  const json none = json::object();
  const json& text = scenario.text;
  set_all(text.value("radio", none), "[radio]",
          {{"range_mm", into(radio.range_mm)},
           {"asymmetry", into(radio.asymmetry)},
           {"loss", into(radio.loss)},
           {"air_us", into(radio.air_us)},
           {"period_us", into(radio.period_us)},
           {"period_jitter", into(radio.period_jitter)},
           {"turnaround_us", into(radio.turnaround_us)},
           {"backoff_us", into(radio.backoff_us)},
           {"distance_noise_mm", into(radio.distance_noise_mm)},
           {"bearing_noise_rad", into(radio.bearing_noise_rad)}});
  set_all(text.value("body", none), "[body]",
          {{"diameter_mm", into(body.diameter_mm)},
           {"wheel_base_mm", into(body.wheel_base_mm)},
           {"speed_mm_per_s", into(body.speed_mm_per_s)},
           {"speed_bias", into(body.speed_bias)},
           {"motion_noise", into(body.motion_noise)}});
  set_all(text.value("clock", none), "[clock]",
          {{"drift_ppm", into(clock.drift_ppm)},
           {"power_on_spread_us", into(clock.power_on_spread_us)}});
  for (const json& fault : text.value("faults", json::array())) {
    faults.push_back(read_fault(fault));
    if (faults.back().robot >= scenario.robots.size()) {
      throw std::runtime_error("scenario: fault robot: there are only " +
                               std::to_string(scenario.robots.size()));
    }
  }
}

}  // namespace swarmtalk::suite
