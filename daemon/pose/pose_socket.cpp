#include "daemon/pose/pose_socket.hpp"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/common/printable.hpp"
#include "daemon/config/file_access.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr SocketKind kPoseKind{SOCK_DGRAM, "node.pose_socket", "is read by a running program",
                               "whether a program reads"};
constexpr int kDatagramsPerTurn = 64;
constexpr double kOldestS = 1e6;  // older makes no difference, and does not overflow

}  // namespace

PoseSocket::PoseSocket(boost::asio::io_context& io, const std::string& path,
                       const SocketConfig& access, const KeyLines& lines, PoseKeeper& poses,
                       DaemonCounters& counters)
    : io_(io),
      file_(path, kPoseKind),
      access_(access),
      lines_(lines),
      poses_(poses),
      counters_(counters),
      socket_(io) {
  open();
}

void PoseSocket::open() {
  file_.open(access_, lines_);
  boost::system::error_code ignored;
  socket_.close(ignored);
  socket_.assign(file_.release());
}

void PoseSocket::start() {
  wait();
  const std::string problem = unseen(file_.path());
  if (!problem.empty()) log_of("daemon")->warn("node.pose_socket: {}", problem);
  watch_.emplace(io_, file_.path(), [this] { return restore(); });
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
  log_of("daemon")->warn("the pose socket {} was deleted and has been made again", file_.path());
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
  const auto now = loop::now();
  if (const auto pose = parse_pose_text(text)) {
    const std::chrono::duration<double> age(std::min(pose->age_s, kOldestS));
    const auto known_at = now - std::chrono::duration_cast<std::chrono::nanoseconds>(age);
    if (poses_.set(pose->x_m, pose->y_m, pose->theta_rad, known_at, "the pose socket")) {
      ++counters_.poses_received;
      return;
    }
  }
  ++counters_.poses_refused;
  if (const auto silent = log_.pass(now)) {
    log_of("daemon")->warn(
        "pose socket: \"{}\" is not a pose; write x and y in metres, -32.767 to 32.767, theta in "
        "radians, and the age in seconds if it is known ({} more since the last line)",
        printable(text), *silent);
  }
}

}  // namespace swarmtalk::daemon
