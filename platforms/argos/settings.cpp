#include "platforms/argos/settings.hpp"

#include <charconv>
#include <cstdio>
#include <limits>
#include <set>

#include "platforms/argos/models.hpp"

namespace swarmtalk::platforms::in_argos {
namespace {

// A radio that reaches farther was meant in cm or mm.
constexpr double kLongestRange = 20;
constexpr double kLongestOfKilobots = 1;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

/// @return what is wrong; empty: `number` has the value
template <typename Number>
std::string read_whole(const std::string& name, const std::string& value, uint32_t most,
                       Number& number) {
  uint64_t read = 0;
  const auto result = std::from_chars(value.data(), value.data() + value.size(), read);
  const bool is_whole = result.ec == std::errc() && result.ptr == value.data() + value.size();
  if (!is_whole || read > most) {
    return "<params> has " + name + "=\"" + value + "\": it is a whole number from 0 to " +
           std::to_string(most);
  }
  number = static_cast<Number>(read);
  return "";
}

}  // namespace

std::string take_attribute(Settings& settings, const std::string& name, const std::string& value) {
  constexpr uint32_t kMostNodes = 65533;
  constexpr uint32_t kMostRoles = 255;
  constexpr uint32_t kMostDrift = 100'000;
  if (name == "index") return read_whole(name, value, kMostNodes, settings.index);
  if (name == "role") return read_whole(name, value, kMostRoles, settings.role);
  if (name == "drift_ppm") return read_whole(name, value, kMostDrift, settings.drift_ppm);
  if (name == "power_on_spread_us") {
    return read_whole(name, value, std::numeric_limits<int32_t>::max(),
                      settings.power_on_spread_us);
  }
  if (name == "random_id") {
    settings.has_random_id = value == "true";
    if (settings.has_random_id || value == "false") return "";
    return "<params> has random_id=\"" + value + "\": it is true or false";
  }
  return "<params> has no attribute '" + name +
         "'; there is: index role random_id drift_ppm power_on_spread_us";
}

std::string complaint_about(const Experiment& experiment) {
  if (experiment.steps_per_second != kStepsPerSecond) {
    return "ticks_per_second is " + std::to_string(experiment.steps_per_second) +
           ": programs count a Kilobot's ticks, write ticks_per_second=\"" +
           std::to_string(kStepsPerSecond) + "\"";
  }
  for (int axis = 0; axis < 2; ++axis) {
    const double size = experiment.arena_max[axis] - experiment.arena_min[axis];
    if (size < 1) {
      return "the arena is " + number(size) +
             " m wide: ARGoS's radios need 1 m or more in x and y, write it into <arena size>";
    }
  }
  std::set<std::string> names;
  for (const Experiment::Place& robot : experiment.robots) {
    const double longest = robot.is_kilobots ? kLongestOfKilobots : kLongestRange;
    if (!(robot.range >= 0 && robot.range <= longest)) {
      return "robot " + robot.name + " has a radio range of " + number(robot.range) +
             " m, at most " + number(longest) +
             " make sense: ARGoS counts in metres, not in mm or cm";
    }
    const double at[2] = {robot.x, robot.y};
    for (int axis = 0; axis < 2; ++axis) {
      if (at[axis] > experiment.arena_min[axis] && at[axis] < experiment.arena_max[axis]) continue;
      return "robot " + robot.name + " stands at " + number(robot.x) + "," + number(robot.y) +
             " m, outside the arena (" + number(experiment.arena_min[0]) + "," +
             number(experiment.arena_min[1]) + " to " + number(experiment.arena_max[0]) + "," +
             number(experiment.arena_max[1]) +
             " m): make <arena size> larger, or give places in metres";
    }
    if (!names.insert(robot.name).second) {
      return "two robots are called " + robot.name + ": give each an id of its own";
    }
  }
  return "";
}

}  // namespace swarmtalk::platforms::in_argos
