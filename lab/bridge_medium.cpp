#include "lab/bridge_medium.hpp"

#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace swarmtalk::lab {
namespace {

constexpr const char* kBridge = "air";

void set_sysctl(const std::string& network_namespace, const std::string& path,
                const std::string& value) {
  // /proc/sys/net shows the namespace of the process that opens it.
  SpawnOptions options;
  options.network_namespace = network_namespace;
  const pid_t pid =
      spawn({"/bin/sh", "-c", "echo " + value + " > /proc/sys/" + path + " 2>/dev/null"}, options);
  int status = 0;
  waitpid(pid, &status, 0);
}

void make_namespace(const std::string& name) {
  run_quietly({"ip", "netns", "add", name});
  // Absent when the kernel has no IPv6 at all, which is as good.
  set_sysctl(name, "net/ipv6/conf/all/disable_ipv6", "1");
  set_sysctl(name, "net/ipv6/conf/default/disable_ipv6", "1");
  run_quietly({"ip", "-n", name, "link", "set", "lo", "up"});
}

}  // namespace

void make_hub(const std::string& hub_namespace) {
  make_namespace(hub_namespace);
  run_quietly({"ip", "-n", hub_namespace, "link", "add", kBridge, "type", "bridge", "stp_state",
               "0", "mcast_snooping", "0"});
  run_quietly({"ip", "-n", hub_namespace, "link", "set", kBridge, "up"});
}

void make_robot_namespace(const std::string& robot_namespace, const std::string& hub_namespace,
                          int robot_number) {
  const std::string port = "robot" + std::to_string(robot_number);
  make_namespace(robot_namespace);
  run_quietly({"ip", "link", "add", kRobotInterface, "netns", robot_namespace, "type", "veth",
               "peer", "name", port, "netns", hub_namespace});
  run_quietly({"ip", "-n", hub_namespace, "link", "set", port, "master", kBridge, "up"});
  run_quietly({"ip", "-n", robot_namespace, "link", "set", kRobotInterface, "up"});
}

bool namespace_exists(const std::string& network_namespace) {
  return !network_namespace.empty() && std::filesystem::exists("/run/netns/" + network_namespace);
}

std::vector<ProcessId> processes_in(const std::string& network_namespace) {
  struct stat wanted {};
  if (network_namespace.empty() ||
      stat(("/run/netns/" + network_namespace).c_str(), &wanted) != 0) {
    return {};
  }
  std::vector<ProcessId> processes;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", error)) {
    const std::string name = entry.path().filename().string();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    struct stat own {};
    if (stat((entry.path() / "ns/net").c_str(), &own) != 0) continue;
    if (own.st_ino == wanted.st_ino && own.st_dev == wanted.st_dev) {
      processes.push_back(identify(static_cast<pid_t>(std::stol(name))));
    }
  }
  return processes;
}

void remove_namespace(const std::string& network_namespace) {
  if (!namespace_exists(network_namespace)) return;
  run_quietly({"ip", "netns", "del", network_namespace});
}

}  // namespace swarmtalk::lab
