#include "daemon/host/listening_socket.hpp"

#include <fcntl.h>
#include <grp.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace swarmtalk::daemon {
namespace {

constexpr const char* kSocketKey = "socket.path";
constexpr int kBacklog = 64;
constexpr int kLockAttempts = 16;

std::string lock_path(const std::string& path) {
  return path + ".lock";
}

std::string folder_of(const std::string& path) {
  return std::filesystem::path(path).parent_path().string();
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), std::min(path.size(), sizeof address.sun_path - 1));
  return address;
}

int socket_call(int (*call)(int, const sockaddr*, socklen_t), int descriptor,
                const std::string& path) {
  const sockaddr_un address = address_of(path);
  return call(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

int new_socket() {
  return socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
}

// What an errno at `path` means to a person, with the remedy.
std::string explain(const std::string& path, int error) {
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return "the folder " + folder_of(path) + " does not exist; create it, or choose another path";
    case EACCES:
    case EPERM:
    case EROFS:
      return "no permission to create " + path + "; run swarmtalkd as a user who may write to " +
             folder_of(path) + ", or choose another path";
    default:
      return path + ": " + std::strerror(error) + "; choose another path";
  }
}

// The same for the lock file, which may stand there already and belong to somebody else.
std::string explain_lock(const std::string& path, int error) {
  const std::string name = lock_path(path);
  struct stat existing {};
  if (lstat(name.c_str(), &existing) != 0) return explain(path, error);
  return "cannot open the lock file " + name + ": " + std::strerror(error) +
         "; remove it if no swarmtalkd runs, or run as its owner";
}

std::string taken(const std::string& path, pid_t pid) {
  const std::string who = pid > 0 ? " (process " + std::to_string(pid) + ")" : "";
  return path + " is served by a running swarmtalkd" + who + "; stop it, or choose another path";
}

struct Probe {
  int error;  // 0: somebody answers
  pid_t pid;  // who listens, if known
};

Probe probe(const std::string& path) {
  const int descriptor = new_socket();
  if (descriptor < 0) return {errno, 0};
  int error = socket_call(connect, descriptor, path) == 0 ? 0 : errno;
  if (error == EAGAIN) error = 0;  // its backlog is full: it lives
  ucred peer{};
  socklen_t size = sizeof peer;
  if (error != 0 || getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    peer.pid = 0;
  }
  close(descriptor);
  return {error, peer.pid};
}

bool is_same_file(int descriptor, const std::string& path) {
  struct stat open_file {};
  struct stat named {};
  return fstat(descriptor, &open_file) == 0 && stat(path.c_str(), &named) == 0 &&
         open_file.st_dev == named.st_dev && open_file.st_ino == named.st_ino;
}

gid_t group_id(const std::string& name, const KeyLines& lines) {
  const group* found = getgrnam(name.c_str());
  if (found == nullptr) {
    throw lines.error("socket.group", "there is no group '" + name +
                                          "'; create it (`groupadd --system " + name +
                                          "`), or leave the key out");
  }
  return found->gr_gid;
}

}  // namespace

ListeningSocket ListeningSocket::open(const SocketConfig& config, const KeyLines& lines) {
  ListeningSocket opened;
  opened.path_ = config.path;
  const int passed = sd_listen_fds(1);
  if (passed > 1) {
    throw lines.error(kSocketKey, "systemd passes " + std::to_string(passed) +
                                      " sockets; keep one ListenStream= in swarmtalkd.socket");
  }
  if (passed == 1) {
    opened.descriptor_ = SD_LISTEN_FDS_START;
    if (sd_is_socket_unix(opened.descriptor_, SOCK_STREAM, 1, nullptr, 0) <= 0) {
      throw lines.error(kSocketKey,
                        "systemd passes something else than a listening Unix stream socket; "
                        "use ListenStream=/PATH in swarmtalkd.socket");
    }
    sockaddr_un address{};
    socklen_t size = sizeof address;
    if (getsockname(opened.descriptor_, reinterpret_cast<sockaddr*>(&address), &size) == 0) {
      opened.path_.assign(address.sun_path, strnlen(address.sun_path, sizeof address.sun_path));
    }
    fcntl(opened.descriptor_, F_SETFL, fcntl(opened.descriptor_, F_GETFL) | O_NONBLOCK);
    return opened;
  }
  opened.lock(lines);
  opened.remove_stale(lines);
  opened.bind_new(config, lines);
  return opened;
}

// The lock file's name may be removed by the daemon that just ended, so what we locked counts only
// if it is still what the name says.
void ListeningSocket::lock(const KeyLines& lines) {
  const std::string name = lock_path(path_);
  for (int attempt = 0; attempt < kLockAttempts; ++attempt) {
    const int descriptor =
        ::open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK, 0600);
    if (descriptor < 0) {
      const int error = errno;
      const Probe other = probe(path_);
      throw lines.error(kSocketKey,
                        other.error == 0 ? taken(path_, other.pid) : explain_lock(path_, error));
    }
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      close(descriptor);
      if (error == EWOULDBLOCK) throw lines.error(kSocketKey, taken(path_, probe(path_).pid));
      throw lines.error(kSocketKey, explain(name, error));
    }
    if (is_same_file(descriptor, name)) {
      lock_ = descriptor;
      return;
    }
    close(descriptor);
  }
  throw lines.error(kSocketKey, name + " keeps changing; is something else using this path?");
}

void ListeningSocket::remove_stale(const KeyLines& lines) const {
  struct stat existing {};
  if (lstat(path_.c_str(), &existing) != 0) {
    if (errno == ENOENT) return;
    throw lines.error(kSocketKey, explain(path_, errno));
  }
  if (!S_ISSOCK(existing.st_mode)) {
    throw lines.error(kSocketKey,
                      path_ + " exists and is no socket; remove it, or choose another path");
  }
  const Probe other = probe(path_);
  if (other.error == 0) throw lines.error(kSocketKey, taken(path_, other.pid));
  if (other.error != ECONNREFUSED) throw lines.error(kSocketKey, explain(path_, other.error));
  if (unlink(path_.c_str()) != 0 && errno != ENOENT) {
    throw lines.error(kSocketKey, explain(path_, errno));
  }
}

void ListeningSocket::bind_new(const SocketConfig& config, const KeyLines& lines) {
  const bool has_group = !config.group.empty();
  const gid_t group = has_group ? group_id(config.group, lines) : 0;
  descriptor_ = new_socket();
  if (descriptor_ < 0) throw lines.error(kSocketKey, explain(path_, errno));
  const mode_t old_mask = umask(0777);  // nobody comes in before group and mode are right
  const int bound = socket_call(bind, descriptor_, path_);
  const int error = errno;
  umask(old_mask);
  if (bound != 0) throw lines.error(kSocketKey, explain(path_, error));
  struct stat made {};
  if (lstat(path_.c_str(), &made) == 0) {
    device_ = made.st_dev;
    inode_ = made.st_ino;
  }
  if (has_group && chown(path_.c_str(), static_cast<uid_t>(-1), group) != 0) {
    throw lines.error("socket.group", "cannot give " + path_ + " to group '" + config.group +
                                          "': " + std::strerror(errno) +
                                          "; run as a member of that group, or as root");
  }
  if (chmod(path_.c_str(), config.mode) != 0) throw lines.error(kSocketKey, explain(path_, errno));
  if (listen(descriptor_, kBacklog) != 0) throw lines.error(kSocketKey, explain(path_, errno));
}

void ListeningSocket::restore(const SocketConfig& config, const KeyLines& lines) {
  if (!is_same_file(lock_, lock_path(path_))) {
    const int old_lock = std::exchange(lock_, -1);
    try {
      lock(lines);
    } catch (...) {
      lock_ = old_lock;
      throw;
    }
    close(old_lock);
  }
  const int old = descriptor_;
  try {
    remove_stale(lines);
    bind_new(config, lines);
  } catch (...) {
    if (descriptor_ != old && descriptor_ >= 0) {
      close(descriptor_);
      unlink(path_.c_str());  // nobody could come in
    }
    descriptor_ = old;
    throw;
  }
  close(old);
}

ListeningSocket::ListeningSocket(ListeningSocket&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      lock_(std::exchange(other.lock_, -1)),
      device_(other.device_),
      inode_(std::exchange(other.inode_, 0)) {}

ListeningSocket::~ListeningSocket() {
  struct stat named {};
  if (inode_ != 0 && lstat(path_.c_str(), &named) == 0 && named.st_dev == device_ &&
      named.st_ino == inode_) {
    unlink(path_.c_str());
  }
  if (descriptor_ >= 0) close(descriptor_);
  if (lock_ < 0) return;
  unlink(lock_path(path_).c_str());  // while it is locked
  close(lock_);
}

}  // namespace swarmtalk::daemon
