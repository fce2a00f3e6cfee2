#include "daemon/host/unix_socket_file.hpp"

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace swarmtalk::daemon {
namespace {

int new_socket(int type) {
  return socket(AF_UNIX, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
}

int socket_call(int (*call)(int, const sockaddr*, socklen_t), int descriptor,
                const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), std::min(path.size(), sizeof address.sun_path - 1));
  return call(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address);
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

/// Closes the descriptor at the end of a scope, unless it is taken.
class Guard {
 public:
  explicit Guard(int descriptor) : descriptor_(descriptor) {}
  ~Guard() {
    if (descriptor_ >= 0) close(descriptor_);
  }
  Guard(const Guard&) = delete;
  Guard& operator=(const Guard&) = delete;
  int get() const { return descriptor_; }
  int take() { return std::exchange(descriptor_, -1); }

 private:
  int descriptor_;
};

}  // namespace

UnixSocketFile::UnixSocketFile(UnixSocketFile&& other) noexcept
    : path_(std::move(other.path_)),
      kind_(other.kind_),
      descriptor_(std::exchange(other.descriptor_, -1)),
      device_(other.device_),
      inode_(std::exchange(other.inode_, 0)) {}

UnixSocketFile& UnixSocketFile::operator=(UnixSocketFile&& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(kind_, other.kind_);
  std::swap(descriptor_, other.descriptor_);
  std::swap(device_, other.device_);
  std::swap(inode_, other.inode_);
  return *this;
}

UnixSocketFile::~UnixSocketFile() {
  remove_own();
  if (descriptor_ >= 0) close(descriptor_);
}

void UnixSocketFile::remove_own() {
  struct stat named {};
  const ino_t own = std::exchange(inode_, 0);
  if (own == 0 || lstat(path_.c_str(), &named) != 0) return;
  if (named.st_dev == device_ && named.st_ino == own) unlink(path_.c_str());
}

int UnixSocketFile::release() {
  return std::exchange(descriptor_, -1);
}

std::string UnixSocketFile::explain(const std::string& path, int error) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  switch (error) {
    case ENOENT:
    case ENOTDIR:
      return "the folder " + folder + " does not exist; create it, or choose another path";
    case EACCES:
    case EPERM:
    case EROFS:
      return "no permission to create " + path + "; run swarmtalkd as a user who may write to " +
             folder + ", or choose another path";
    case EMFILE:
    case ENFILE:
      return path + ": " + std::strerror(error);
    default:
      return path + ": " + std::strerror(error) + "; choose another path";
  }
}

std::string UnixSocketFile::taken(pid_t pid) const {
  const std::string who = pid > 0 ? " (process " + std::to_string(pid) + ")" : "";
  return path_ + " " + kind_->is_used_by + who + "; stop it, or choose another path";
}

UnixSocketFile::Answer UnixSocketFile::probe() const {
  const Guard socket(new_socket(kind_->type));
  if (socket.get() < 0) return {errno, 0};
  int error = socket_call(connect, socket.get(), path_) == 0 ? 0 : errno;
  if (error == EAGAIN) error = 0;  // its backlog is full: it lives
  ucred peer{};
  socklen_t size = sizeof peer;
  if (error != 0 || getsockopt(socket.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    peer.pid = 0;
  }
  return {error, peer.pid};
}

void UnixSocketFile::open(const SocketConfig& access, const KeyLines& lines) {
  const gid_t group = access.group.empty() ? static_cast<gid_t>(-1) : group_id(access.group, lines);
  Guard made(new_socket(kind_->type));
  if (made.get() < 0) throw lines.error(kind_->key, explain(path_, errno));
  remove_stale(lines);
  const mode_t old_mask = umask(0777);  // nobody comes in before group and mode are right
  const int bound = socket_call(bind, made.get(), path_);
  const int error = errno;
  umask(old_mask);
  if (bound != 0) throw lines.error(kind_->key, explain(path_, error));
  struct stat named {};
  if (lstat(path_.c_str(), &named) == 0) {
    device_ = named.st_dev;
    inode_ = named.st_ino;
  }
  try {
    set_access(access, group, lines);
  } catch (...) {
    remove_own();
    throw;
  }
  if (descriptor_ >= 0) close(descriptor_);
  descriptor_ = made.take();
}

void UnixSocketFile::remove_stale(const KeyLines& lines) const {
  struct stat existing {};
  if (lstat(path_.c_str(), &existing) != 0) {
    if (errno == ENOENT) return;
    throw lines.error(kind_->key, explain(path_, errno));
  }
  if (!S_ISSOCK(existing.st_mode)) {
    throw lines.error(kind_->key,
                      path_ + " exists and is not a socket; remove it, or choose another path");
  }
  const Answer other = probe();
  if (other.error == 0) throw lines.error(kind_->key, taken(other.pid));
  if (other.error == ENOENT) return;  // meanwhile
  if (other.error == EMFILE || other.error == ENFILE) {
    throw lines.error(kind_->key, explain(path_, other.error));
  }
  if (other.error != ECONNREFUSED) {  // the one answer that says that nobody uses it
    throw lines.error(kind_->key, std::string("cannot tell ") + kind_->is_it_used + " " + path_ +
                                      ": " + std::strerror(other.error) +
                                      "; remove it if none does, or choose another path");
  }
  if (unlink(path_.c_str()) != 0 && errno != ENOENT) {
    throw lines.error(kind_->key, explain(path_, errno));
  }
}

void UnixSocketFile::set_access(const SocketConfig& access, gid_t group,
                                const KeyLines& lines) const {
  struct stat made {};
  const bool is_given = access.group.empty() ||
                        (lstat(path_.c_str(), &made) == 0 && made.st_gid == group) ||
                        chown(path_.c_str(), static_cast<uid_t>(-1), group) == 0;
  if (!is_given) {
    throw lines.error("socket.group", "cannot give " + path_ + " to group '" + access.group +
                                          "': " + std::strerror(errno) +
                                          "; run as a member of that group, or as root");
  }
  if (chmod(path_.c_str(), access.mode) != 0) throw lines.error(kind_->key, explain(path_, errno));
}

}  // namespace swarmtalk::daemon
