#include "lab/network_namespace.hpp"

#include <linux/capability.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <stdexcept>
#include <utility>

namespace swarmtalk::lab {
namespace {

void set_sysctl(const std::string& network_namespace, const std::string& path,
                const std::string& value) {
  // /proc/sys/net shows the namespace of the process that opens it.
  SpawnOptions options;
  options.network_namespace = network_namespace;
  options.dies_with_parent = true;
  const pid_t pid =
      spawn({"/bin/sh", "-c", "echo " + value + " > /proc/sys/" + path + " 2>/dev/null"}, options);
  int status = 0;
  waitpid(pid, &status, 0);
}

bool namespace_exists(const std::string& network_namespace) {
  return !network_namespace.empty() && std::filesystem::exists("/run/netns/" + network_namespace);
}

bool has_capability(int capability) {
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct sets[_LINUX_CAPABILITY_U32S_3]{};
  if (syscall(SYS_capget, &header, sets) != 0) return true;  // what is missing shows later
  return (sets[CAP_TO_INDEX(capability)].effective & CAP_TO_MASK(capability)) != 0;
}

}  // namespace

std::string namespace_prefix(const std::string& lab_name) {
  return "swarmtalk-" + lab_name + "-";
}

std::vector<std::string> namespaces_of(const std::string& lab_name) {
  const std::string prefix = namespace_prefix(lab_name);
  std::vector<std::string> names;
  if (geteuid() != 0) return names;  // they are root's
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator("/run/netns", error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix) || name == prefix) continue;
    const std::string robot = name.substr(prefix.size());  // the lab "a-1" has others than "a"
    if (robot == "air" || robot.find_first_not_of("0123456789") == std::string::npos) {
      names.push_back(name);
    }
  }
  return names;
}

std::string why_no_namespaces() {
  if (geteuid() != 0) return "network namespaces need root";
  constexpr std::pair<int, const char*> kNeeded[]{{CAP_SYS_ADMIN, "CAP_SYS_ADMIN"},
                                                  {CAP_NET_ADMIN, "CAP_NET_ADMIN"},
                                                  {CAP_NET_RAW, "CAP_NET_RAW"}};
  for (const auto& [capability, name] : kNeeded) {
    if (has_capability(capability)) continue;
    return std::string("this root lacks ") + name + " (a container?), which network namespaces " +
           "with raw layer-2 frames need";
  }
  return find_program("ip").empty() ? "network namespaces need the program ip" : "";
}

std::string with_sudo() {
  // Debian's sudo resets PATH to folders of the system.
  const bool is_installed = own_folder().string().starts_with("/usr/");
  const std::string as_root =
      is_installed ? "sudo" : R"(sudo env PATH="$PATH" PYTHONPATH="$PYTHONPATH")";
  return as_root + " swarmtalk-lab ...";
}

std::string namespace_problem(const std::string& instead) {
  const std::string why = why_no_namespaces();
  if (why.empty()) return why;
  std::string remedy = ": run it as ";
  if (geteuid() != 0) remedy = ": run it with `" + with_sudo() + "`, or without root as ";
  if (why.ends_with("program ip")) remedy = ": sudo apt install iproute2, or run it as ";
  return why + remedy + "`swarmtalk-lab ... --medium " + instead + "`";
}

void make_namespace(const std::string& name) {
  run_quietly({"ip", "netns", "add", name});
  // Absent when the kernel has no IPv6 at all, which is as good.
  set_sysctl(name, "net/ipv6/conf/all/disable_ipv6", "1");
  set_sysctl(name, "net/ipv6/conf/default/disable_ipv6", "1");
  run_quietly({"ip", "-n", name, "link", "set", "lo", "up"});
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
  try {
    run_quietly({"ip", "netns", "del", network_namespace});
  } catch (const std::runtime_error&) {
    if (namespace_exists(network_namespace)) throw;  // else somebody else has just removed it
  }
}

}  // namespace swarmtalk::lab
