#include "daemon/host/listening_socket.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace swarmtalk::daemon {
namespace {

constexpr const char* kSocketKey = "socket.path";
constexpr SocketKind kListeningKind{SOCK_STREAM, kSocketKey, "is served by a running swarmtalkd",
                                    "whether a program serves"};
constexpr int kBacklog = 64;
constexpr int kLockAttempts = 16;

std::string lock_path(const std::string& path) {
  return path + ".lock";
}

// What an errno at the lock file means, which may stand there already and belong to somebody else.
std::string explain_lock(const std::string& path, int error) {
  const std::string name = lock_path(path);
  struct stat existing {};
  if (lstat(name.c_str(), &existing) != 0) return UnixSocketFile::explain(path, error);
  return "cannot open the lock file " + name + ": " + std::strerror(error) +
         "; remove it if no swarmtalkd runs, or run as its owner";
}

bool is_same_file(int descriptor, const std::string& path) {
  struct stat open_file {};
  struct stat named {};
  return fstat(descriptor, &open_file) == 0 && stat(path.c_str(), &named) == 0 &&
         open_file.st_dev == named.st_dev && open_file.st_ino == named.st_ino;
}

}  // namespace

ListeningSocket::ListeningSocket(const std::string& path)
    : path_(path), file_(path, kListeningKind) {}

ListeningSocket ListeningSocket::open(const SocketConfig& config, const KeyLines& lines) {
  ListeningSocket opened(config.path);
  const int passed = sd_listen_fds(1);
  if (passed > 1) {
    throw lines.error(kSocketKey, "systemd passes " + std::to_string(passed) +
                                      " sockets; keep one ListenStream= in swarmtalkd.socket");
  }
  if (passed == 1) {
    opened.passed_ = SD_LISTEN_FDS_START;
    if (sd_is_socket_unix(opened.passed_, SOCK_STREAM, 1, nullptr, 0) <= 0) {
      throw lines.error(kSocketKey,
                        "systemd passes something else than a listening Unix stream socket; "
                        "use ListenStream=/PATH in swarmtalkd.socket");
    }
    sockaddr_un address{};
    socklen_t size = sizeof address;
    if (getsockname(opened.passed_, reinterpret_cast<sockaddr*>(&address), &size) == 0) {
      opened.path_.assign(address.sun_path, strnlen(address.sun_path, sizeof address.sun_path));
    }
    fcntl(opened.passed_, F_SETFL, fcntl(opened.passed_, F_GETFL) | O_NONBLOCK);
    return opened;
  }
  opened.lock(lines);
  opened.make(config, lines);
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
      const UnixSocketFile::Answer other = file_.probe();
      throw lines.error(kSocketKey,
                        other.error == 0 ? file_.taken(other.pid) : explain_lock(path_, error));
    }
    if (flock(descriptor, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      close(descriptor);
      if (error == EWOULDBLOCK) throw lines.error(kSocketKey, file_.taken(file_.probe().pid));
      throw lines.error(kSocketKey, UnixSocketFile::explain(name, error));
    }
    if (is_same_file(descriptor, name)) {
      lock_ = descriptor;
      return;
    }
    close(descriptor);
  }
  throw lines.error(kSocketKey, name + " keeps changing; is something else using this path?");
}

// Into the place of the one before, which stays when this fails.
void ListeningSocket::make(const SocketConfig& config, const KeyLines& lines) {
  UnixSocketFile made(path_, kListeningKind);
  made.open(config, lines);
  if (listen(made.descriptor(), kBacklog) != 0) {
    throw lines.error(kSocketKey, UnixSocketFile::explain(path_, errno));
  }
  file_ = std::move(made);
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
  make(config, lines);
}

bool ListeningSocket::is_awaited() const {
  pollfd waiting{descriptor(), POLLIN, 0};
  return poll(&waiting, 1, 0) == 1;
}

ListeningSocket::ListeningSocket(ListeningSocket&& other) noexcept
    : path_(std::move(other.path_)),
      file_(std::move(other.file_)),
      passed_(std::exchange(other.passed_, -1)),
      lock_(std::exchange(other.lock_, -1)) {}

ListeningSocket::~ListeningSocket() {
  if (passed_ >= 0) close(passed_);
  if (lock_ < 0) return;
  { const UnixSocketFile removed = std::move(file_); }  // while it is locked
  unlink(lock_path(path_).c_str());
  close(lock_);
}

}  // namespace swarmtalk::daemon
