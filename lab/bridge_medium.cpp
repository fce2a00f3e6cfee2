#include "lab/bridge_medium.hpp"

#include "lab/interrupt.hpp"
#include "lab/network_namespace.hpp"

namespace swarmtalk::lab {
namespace {

constexpr const char* kBridge = "air";

void make_hub(const std::string& hub_namespace) {
  make_namespace(hub_namespace);
  run_quietly({"ip", "-n", hub_namespace, "link", "add", kBridge, "type", "bridge", "stp_state",
               "0", "mcast_snooping", "0"});
  run_quietly({"ip", "-n", hub_namespace, "link", "set", kBridge, "up"});
}

void make_robot_namespace(const Robot& robot, const std::string& hub_namespace) {
  const std::string port = "robot" + std::to_string(robot.number);
  make_namespace(robot.network_namespace);
  run_quietly({"ip", "link", "add", kRobotInterface, "netns", robot.network_namespace, "type",
               "veth", "peer", "name", port, "netns", hub_namespace});
  run_quietly({"ip", "-n", hub_namespace, "link", "set", port, "master", kBridge, "up"});
  run_quietly({"ip", "-n", robot.network_namespace, "link", "set", kRobotInterface, "up"});
}

}  // namespace

std::string BridgeMedium::problem() const {
  return namespace_problem(without_namespaces());
}

void BridgeMedium::plan(State& state) const {
  const std::string prefix = namespace_prefix(state.name);
  state.hub_namespace = prefix + "air";
  for (Robot& robot : state.robots) {
    robot.network_namespace = prefix + std::to_string(robot.number);
  }
}

void BridgeMedium::make(State& state) const {
  make_hub(state.hub_namespace);
  for (const Robot& robot : state.robots) {
    throw_if_interrupted();
    make_robot_namespace(robot, state.hub_namespace);
  }
}

LinkKeys BridgeMedium::link_of(const State&, const Robot&) const {
  return {{"type", "raw_l2"}, {"interface", kRobotInterface}};
}

void BridgeMedium::remove(const State& state) const {
  for (const Robot& robot : state.robots) remove_namespace(robot.network_namespace);
  remove_namespace(state.hub_namespace);
}

}  // namespace swarmtalk::lab
