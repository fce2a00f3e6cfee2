#include "platforms/argos/settings.hpp"

#include <cstdio>
#include <set>

#include "platforms/argos/models.hpp"

namespace swarmtalk::platforms::in_argos {
namespace {

constexpr double kLongestRange = 20;  // a radio that reaches farther was meant in cm or mm

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

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
    if (robot.range < 0 || robot.range > kLongestRange) {
      return "robot " + robot.name + " has a radio range of " + number(robot.range) +
             " m: ARGoS counts in metres, not in mm or cm";
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
