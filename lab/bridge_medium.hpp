// The medium `bridge`: one network namespace per robot, joined by an Ethernet bridge that lives in
// a namespace of its own. Nothing is made in the machine's own network. Needs root. All hear all.
#pragma once

#include "lab/medium.hpp"

namespace swarmtalk::lab {

/// Name of the interface inside each robot's namespace; what a Raspberry Pi calls its radio.
inline constexpr const char* kRobotInterface = "wlan0";

class BridgeMedium final : public Medium {
 public:
  std::string name() const override { return "bridge"; }
  std::string problem() const override;
  std::string without_namespaces() const override { return "udp"; }
  void plan(State& state) const override;
  void make(State& state) const override;
  LinkKeys link_of(const State& state, const Robot& robot) const override;
  void remove(const State& state) const override;
};

}  // namespace swarmtalk::lab
