#include "daemon/config/file_access.hpp"

#include <fcntl.h>
#include <pwd.h>
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "text/plain.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr const char* kOwnFolder = "/etc/swarmtalk";
constexpr uid_t kFirstPerson = 1000;  // below are root and the users of daemons

std::string user() {
  const passwd* const entry = getpwuid(geteuid());
  return entry == nullptr ? std::to_string(geteuid()) : entry->pw_name;
}

/// What stands before a command for root where it is typed: not where root itself reads this.
std::string sudo() {
  return geteuid() == 0 && std::getenv("SUDO_USER") == nullptr ? "" : "sudo ";
}

bool is_denied(const std::string& path, int mode) {
  return faccessat(AT_FDCWD, path.c_str(), mode, AT_EACCESS) != 0 && errno == EACCES;
}

/// The folders above `path` that this process may not enter, or cannot see for that.
/// @return " FOLDER FOLDER"; empty: all are open
std::string closed_folders(const std::string& path) {
  std::string folders;
  for (std::size_t slash = path.find('/', 1); slash != std::string::npos;
       slash = path.find('/', slash + 1)) {
    const std::string folder = path.substr(0, slash);
    if (is_denied(folder, X_OK)) folders += " " + text::shell_word(folder);
  }
  return folders;
}

/// For a file that is not where the daemon can read it: a copy in the folder of its own.
std::string install(const std::string& path, const std::string& options, const char* name_it) {
  const std::string copy = kOwnFolder + ("/" + std::filesystem::path(path).filename().string());
  return fmt::format("run: {}install -D {} {} {}, and name that file {}", sudo(), options,
                     text::shell_word(path), text::shell_word(copy), name_it);
}

std::string install_configuration(const std::string& path) {
  return install(path, "-m 0644", "with --config");
}

std::string install_key(const std::string& path) {
  return install(path, "-o " + user() + " -m 0400", "instead");
}

}  // namespace

std::string reader() {
  return geteuid() == 0 ? "root without capabilities" : "user " + user();
}

std::string hidden_folder(const std::string& path) {
  std::ifstream mounts("/proc/self/mountinfo");
  return hidden_folder(path, mounts);
}

std::string hidden_folder(const std::string& path, std::istream& mounts) {
  for (std::string line; std::getline(mounts, line);) {
    std::istringstream fields(line);  // proc(5): id, parent, device, root, mount point
    std::string skipped, root, folder;
    fields >> skipped >> skipped >> skipped >> root >> folder;
    const bool is_own = root.find("/systemd-private-") != std::string::npos ||
                        root.find("/systemd/inaccessible/") != std::string::npos;
    if (is_own && path.starts_with(folder + "/")) return folder;
  }
  return {};
}

std::string unseen(const std::string& path) {
  const std::string folder = hidden_folder(path);
  if (folder.empty()) return {};
  return "no other program sees " + path + ", as the unit of this daemon gives it a " + folder +
         " of its own; choose a path below /run/swarmtalkd";
}

std::string unreadable(const std::string& path, int error, FileKind kind) {
  const bool is_key = kind == FileKind::kKey;
  const std::string what = std::strerror(error);
  if (const std::string folder = hidden_folder(path);
      !folder.empty() && (error == EACCES || error == ENOENT)) {
    return "cannot be read: " + what + ", as the unit of this daemon hides " + folder +
           " from it; " + (is_key ? install_key(path) : install_configuration(path));
  }
  if (error == EACCES) {
    const std::string denied = "cannot be read by " + reader() + ": " + what + "; ";
    const std::string closed = closed_folders(path);
    const std::string open = closed.empty() ? "" : sudo() + "chmod a+x" + closed + " && ";
    if (!is_key) return denied + "run: " + open + sudo() + "chmod a+r " + text::shell_word(path);
    const bool is_ours = std::filesystem::path(path).parent_path() == kOwnFolder;
    if (!closed.empty() && !is_ours) return denied + install_key(path);
    return denied + "run: " + open + own_key_command(path, 0);
  }
  if (!is_key) {
    return "cannot be read: " + what + "; put one there, or start swarmtalkd with --config FILE";
  }
  if (error != ENOENT) return "cannot be read: " + what + "; give the path of another file";
  return fmt::format(
      "cannot be read: {}; put the key of the swarm there: {}install -D -o {} -m 0400 FILE {} "
      "(`swarmtalk-cli keygen FILE` makes one for all robots)",
      what, sudo(), user(), text::shell_word(path));
}

std::vector<std::string> later_troubles(const Config& config, const std::string& file,
                                        const std::string& made_socket) {
  std::vector<std::string> troubles;
  const auto look = [&](const std::string& path, FileKind kind) {
    if (path.empty() || !is_denied(path, R_OK)) return;
    troubles.push_back("a reload will fail: " + path + " " + unreadable(path, EACCES, kind));
  };
  look(file, FileKind::kConfiguration);
  for (const LinkConfig& link : config.links) {
    look(link.key_file, FileKind::kKey);
    look(link.also_key_file, FileKind::kKey);
  }
  for (const std::string& socket : {made_socket, config.node.pose_socket}) {
    const std::string folder = std::filesystem::path(socket).parent_path();
    if (socket.empty() || !is_denied(folder, W_OK | X_OK)) continue;
    troubles.push_back(fmt::format(
        "{} may not write to {}: the socket {} stays there at the end, and is not made again when "
        "it is deleted; choose a path in a folder of {}",
        reader(), folder, socket, user()));
  }
  return troubles;
}

std::string own_key_command(const std::string& path, uid_t owner) {
  const bool is_of_a_person = owner == geteuid() && owner >= kFirstPerson;
  const std::string file = text::shell_word(path);
  if (is_of_a_person) return "chmod 0400 " + file;
  return fmt::format("{0}chown {1} {2} && {0}chmod 0400 {2}", sudo(), user(), file);
}

}  // namespace swarmtalk::daemon
