#include "serial/holders.hpp"

#include <dirent.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>

#include "text/plain.hpp"

namespace swarmtalk::serial {
namespace {

// Documentation/admin-guide/devices.txt of Linux.
constexpr unsigned kFirstPtsMajor = 136;
constexpr unsigned kLastPtsMajor = 143;
const dev_t kPtyMaster = makedev(5, 2);

/// @return false: it cannot be read (errno)
bool for_entries(const std::string& folder, const std::function<void(const char*)>& each) {
  const std::unique_ptr<DIR, int (*)(DIR*)> list(::opendir(folder.c_str()), &::closedir);
  if (!list) return false;
  while (const dirent* const entry = ::readdir(list.get())) each(entry->d_name);
  return true;
}

std::optional<dev_t> device_at(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return std::nullopt;
  return status.st_rdev;
}

bool is_pts(dev_t device) {
  return major(device) >= kFirstPtsMajor && major(device) <= kLastPtsMajor;
}

/// @return none: it may not be looked into
std::optional<bool> has_open(int pid, dev_t device) {
  const std::string folder = "/proc/" + std::to_string(pid) + "/fd";
  bool has_device = false;
  bool has_master = false;
  bool is_hidden = false;  // the folder may be open to us, and what is in it not
  const bool is_read = for_entries(folder, [&](const char* name) {
    errno = 0;
    const auto open = device_at(folder + "/" + name);
    is_hidden = is_hidden || errno == EACCES || errno == EPERM;
    has_device = has_device || open == device;
    has_master = has_master || open == kPtyMaster;
  });
  is_hidden = is_hidden || (!is_read && (errno == EACCES || errno == EPERM));
  if (is_hidden) return std::nullopt;
  return has_device && !(has_master && is_pts(device));
}

}  // namespace

Holders other_holders(const std::string& device) {
  Holders holders;
  const auto wanted = device_at(device);
  if (!wanted) return holders;
  for_entries("/proc", [&](const char* name) {
    const int pid = std::atoi(name);
    if (pid <= 0 || pid == ::getpid()) return;
    const auto has = has_open(pid, *wanted);
    if (!has) holders.are_all = false;
    if (!has.value_or(false)) return;
    std::string program;
    std::getline(std::ifstream("/proc/" + std::to_string(pid) + "/comm"), program);
    holders.seen.push_back({pid, text::plain(program)});
  });
  std::sort(holders.seen.begin(), holders.seen.end(),
            [](const Holder& a, const Holder& b) { return a.pid < b.pid; });
  return holders;
}

bool still_holds(const Holder& holder, const std::string& device) {
  const auto wanted = device_at(device);
  return wanted && has_open(holder.pid, *wanted).value_or(true);
}

std::string text_of(const std::vector<Holder>& holders) {
  std::string text;
  for (const Holder& each : holders) {
    text +=
        (text.empty() ? "pid " : ", pid ") + std::to_string(each.pid) + " (" + each.program + ")";
  }
  return text;
}

}  // namespace swarmtalk::serial
