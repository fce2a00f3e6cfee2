// The medium `bridge`: one network namespace per robot, joined by an Ethernet bridge that lives in
// a namespace of its own. Nothing is made in the machine's own network. Needs root.
#pragma once

#include <string>
#include <vector>

#include "lab/process.hpp"

namespace swarmtalk::lab {

/// Name of the interface inside each robot's namespace; what a Raspberry Pi calls its radio.
inline constexpr const char* kRobotInterface = "wlan0";

/// Makes the namespace of the bridge.
void make_hub(const std::string& hub_namespace);

/// Makes a robot's namespace and joins it to the bridge. IPv6 is switched off in it, so that the
/// kernel says nothing on the wire by itself.
void make_robot_namespace(const std::string& robot_namespace, const std::string& hub_namespace,
                          int robot_number);

/// Processes that run inside a namespace.
std::vector<ProcessId> processes_in(const std::string& network_namespace);

/// Removes a namespace and all interfaces in it. Nothing happens when there is none.
void remove_namespace(const std::string& network_namespace);

bool namespace_exists(const std::string& network_namespace);

}  // namespace swarmtalk::lab
