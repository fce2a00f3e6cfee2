// Network namespaces by name, as `ip netns` makes them. Need root.
#pragma once

#include <string>
#include <vector>

#include "lab/process.hpp"

namespace swarmtalk::lab {

/// What of a lab each namespace's name begins with: "swarmtalk-LAB-".
std::string namespace_prefix(const std::string& lab_name);

/// Those that there are of a lab of this user's.
std::vector<std::string> namespaces_of(const std::string& lab_name);

/// Why network namespaces, and raw layer-2 frames in them, cannot be had here, as the beginning of
/// a sentence; empty: they can.
std::string why_no_namespaces();

/// How a command of swarmtalk-lab is typed so that root finds the same programs.
std::string with_sudo();

/// Why network namespaces, and raw layer-2 frames in them, cannot be had here, in one line with
/// what to do; empty: they can. @param instead  the medium that needs none
std::string namespace_problem(const std::string& instead);

/// Makes one with its loopback interface up. IPv6 is switched off in it, so that the kernel says
/// nothing on the wire by itself.
void make_namespace(const std::string& name);

/// Processes that run inside a namespace.
std::vector<ProcessId> processes_in(const std::string& network_namespace);

/// Removes a namespace and all interfaces in it. Nothing happens when there is none.
void remove_namespace(const std::string& network_namespace);

}  // namespace swarmtalk::lab
