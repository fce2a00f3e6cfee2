#include "daemon/host/memory_limit.hpp"

#include <algorithm>
#include <fstream>

namespace swarmtalk::daemon {
namespace {

constexpr std::uint64_t kNoLimit = std::uint64_t{1} << 50;  // version 1 writes a huge number

/// Of the group and of those around it. "max" is no number.
void look(const std::string& mount, std::string group, const char* file,
          std::optional<std::uint64_t>& least) {
  for (;;) {
    std::uint64_t bytes = 0;
    std::ifstream stream(mount + group + "/" + file);
    if (stream >> bytes && bytes < kNoLimit) least = std::min(least.value_or(bytes), bytes);
    if (group.empty() || group == "/") return;
    group.erase(group.rfind('/'));
  }
}

}  // namespace

std::optional<std::uint64_t> memory_limit_bytes(const std::string& root) {
  std::optional<std::uint64_t> least;
  std::ifstream groups(root + "/proc/self/cgroup");
  const std::string mount = root + "/sys/fs/cgroup";
  for (std::string line; std::getline(groups, line);) {  // NUMBER:CONTROLLERS:/GROUP
    const std::size_t first = line.find(':');
    const std::size_t second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const std::string group = line.substr(second + 1);
    if (controllers.empty()) look(mount, group, "memory.max", least);
    if (controllers == "memory") look(mount + "/memory", group, "memory.limit_in_bytes", least);
  }
  return least;
}

}  // namespace swarmtalk::daemon
