#include "daemon/pose/pose_socket.hpp"

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/common/printable.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr const char* kPoseSocketKey = "node.pose_socket";
constexpr int kDatagramsPerTurn = 64;
constexpr double kOldestS = 1e6;  // older makes no difference, and does not overflow

int new_socket() {
  return socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), std::min(path.size(), sizeof address.sun_path - 1));
  return address;
}

/// @param probe  an unconnected socket of this type
void remove_stale(const std::string& path, const sockaddr_un& address, int probe,
                  const KeyLines& lines) {
  struct stat existing {};
  if (lstat(path.c_str(), &existing) != 0) return;
  if (!S_ISSOCK(existing.st_mode)) {
    throw lines.error(kPoseSocketKey,
                      path + " exists and is no socket; remove it, or choose another path");
  }
  if (connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    throw lines.error(kPoseSocketKey,
                      path + " is read by a running program; stop it, or choose another path");
  }
  if (errno == ENOENT) return;  // meanwhile
  if (errno != ECONNREFUSED) {  // the one answer that says that nobody reads it
    throw lines.error(kPoseSocketKey, "cannot tell whether a program reads " + path + ": " +
                                          std::strerror(errno) +
                                          "; remove it if none does, or choose another path");
  }
  unlink(path.c_str());
}

}  // namespace

PoseSocket::PoseSocket(boost::asio::io_context& io, const std::string& path,
                       const SocketConfig& access, const KeyLines& lines, PoseKeeper& poses,
                       DaemonCounters& counters)
    : io_(io),
      path_(path),
      access_(access),
      lines_(lines),
      poses_(poses),
      counters_(counters),
      socket_(io) {
  open();
}

PoseSocket::~PoseSocket() {
  remove_own();
}

void PoseSocket::remove_own() const {
  struct stat named {};
  if (inode_ == 0 || lstat(path_.c_str(), &named) != 0) return;
  if (named.st_dev == device_ && named.st_ino == inode_) unlink(path_.c_str());
}

void PoseSocket::open() {
  const sockaddr_un address = address_of(path_);
  const int descriptor = new_socket();
  if (descriptor < 0) throw lines_.error(kPoseSocketKey, path_ + ": " + std::strerror(errno));
  boost::system::error_code ignored;
  socket_.close(ignored);
  socket_.assign(descriptor);
  remove_stale(path_, address, descriptor, lines_);
  const mode_t old_mask = umask(0777);  // nobody writes before group and mode are right
  const int bound = bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int error = errno;
  umask(old_mask);
  if (bound != 0) {
    throw lines_.error(kPoseSocketKey,
                       "cannot make " + path_ + ": " + std::strerror(error) +
                           "; its folder must exist, and swarmtalkd may write to it");
  }
  struct stat made {};
  if (lstat(path_.c_str(), &made) == 0) {
    device_ = made.st_dev;
    inode_ = made.st_ino;
  }
  try {
    give_to_group();
  } catch (...) {
    remove_own();
    throw;
  }
}

void PoseSocket::give_to_group() const {
  if (!access_.group.empty()) {
    struct stat made {};
    const group* const found = getgrnam(access_.group.c_str());
    const bool is_known = found != nullptr && lstat(path_.c_str(), &made) == 0;
    const bool is_given =
        is_known && (made.st_gid == found->gr_gid ||
                     chown(path_.c_str(), static_cast<uid_t>(-1), found->gr_gid) == 0);
    if (!is_given) {
      throw lines_.error("socket.group",
                         "cannot give " + path_ + " to group '" + access_.group + "': " +
                             (found == nullptr ? "there is no such group" : std::strerror(errno)) +
                             "; run as a member of that group, or leave the key out");
    }
  }
  if (chmod(path_.c_str(), access_.mode) == 0) return;
  throw lines_.error(kPoseSocketKey,
                     "cannot set the mode of " + path_ + ": " + std::strerror(errno));
}

void PoseSocket::start() {
  wait();
  watch_.emplace(io_, path_, [this] { return restore(); });
}

bool PoseSocket::restore() {
  const bool is_first = !std::exchange(is_gone_, true);
  try {
    open();
  } catch (const std::exception& error) {
    if (is_first) {
      log_of("daemon")->error("the pose socket was deleted, so no pose can come: {}", error.what());
    }
    return false;
  }
  is_gone_ = false;
  wait();
  log_of("daemon")->warn("the pose socket {} was deleted; it is made anew", path_);
  return true;
}

void PoseSocket::wait() {
  socket_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [this](const boost::system::error_code& error) {
                       if (error) return;
                       read_all();
                       wait();
                     });
}

void PoseSocket::read_all() {
  for (int i = 0; i < kDatagramsPerTurn; ++i) {
    const ssize_t got = recv(socket_.native_handle(), buffer_.data(), buffer_.size(), 0);
    if (got < 0) return;
    take({buffer_.data(), static_cast<std::size_t>(got)});
  }
}

void PoseSocket::take(std::string_view text) {
  const auto now = std::chrono::steady_clock::now();
  if (const auto pose = parse_pose_text(text)) {
    const std::chrono::duration<double> age(std::min(pose->age_s, kOldestS));
    const auto known_at = now - std::chrono::duration_cast<std::chrono::nanoseconds>(age);
    if (poses_.set(pose->x_m, pose->y_m, pose->theta_rad, known_at)) {
      ++counters_.poses_received;
      return;
    }
  }
  ++counters_.poses_refused;
  if (const auto silent = log_.pass(now)) {
    log_of("daemon")->warn(
        "pose socket: \"{}\" is no pose; write x and y in metres, -32.767 to 32.767, theta in "
        "radians, and the age in seconds if it is known ({} more since the last line)",
        printable(text), *silent);
  }
}

}  // namespace swarmtalk::daemon
