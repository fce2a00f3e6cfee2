#include "platforms/argos/experiment_file.hpp"

#include <argos3/core/simulator/simulator.h>
#include <argos3/core/utility/math/vector3.h>

#include "platforms/argos/settings.hpp"

namespace swarmtalk::platforms::in_argos {
namespace {

using argos::CARGoSException;  // ARGoS's macros call it by this name
using argos::CVector3;
using argos::GetNode;
using argos::GetNodeAttribute;
using argos::GetNodeAttributeOrDefault;
using argos::NodeExists;
using argos::TConfigurationNode;

void read_range(TConfigurationNode& robot, Experiment::Place& place) {
  GetNodeAttributeOrDefault(robot, "communication_range", place.range, place.range);
  GetNodeAttributeOrDefault(robot, "rab_range", place.range, place.range);
  place.is_kilobots = robot.Value() == "kilobot";
}

Experiment read_experiment() {
  Experiment found;
  TConfigurationNode& root = argos::CSimulator::GetInstance().GetConfigurationRoot();
  GetNodeAttribute(GetNode(GetNode(root, "framework"), "experiment"), "ticks_per_second",
                   found.steps_per_second);
  TConfigurationNode& arena = GetNode(root, "arena");
  CVector3 size;
  CVector3 center;
  GetNodeAttribute(arena, "size", size);
  GetNodeAttributeOrDefault(arena, "center", center, center);
  found.arena_min[0] = center.GetX() - size.GetX() / 2;
  found.arena_max[0] = center.GetX() + size.GetX() / 2;
  found.arena_min[1] = center.GetY() - size.GetY() / 2;
  found.arena_max[1] = center.GetY() + size.GetY() / 2;
  argos::TConfigurationNodeIterator each;
  for (each = each.begin(&arena); each != each.end(); ++each) {
    // What <distribute> makes has no place yet; ARGoS puts it where it fits.
    if (!NodeExists(*each, "controller") || !NodeExists(*each, "body")) continue;
    Experiment::Place robot;
    CVector3 position;
    GetNodeAttribute(*each, "id", robot.name);
    GetNodeAttribute(GetNode(*each, "body"), "position", position);
    robot.x = position.GetX();
    robot.y = position.GetY();
    read_range(*each, robot);
    found.robots.push_back(robot);
  }
  return found;
}

}  // namespace

void check_experiment_file() {
  static bool is_checked = false;
  if (is_checked) return;
  is_checked = true;
  const std::string complaint = complaint_about(read_experiment());
  if (!complaint.empty()) THROW_ARGOSEXCEPTION(complaint);
}

}  // namespace swarmtalk::platforms::in_argos
