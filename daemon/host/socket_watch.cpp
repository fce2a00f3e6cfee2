#include "daemon/host/socket_watch.hpp"

#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "daemon/common/logging.hpp"

namespace swarmtalk::daemon {

SocketWatch::SocketWatch(boost::asio::io_context& io, const std::string& path,
                         std::function<bool()> restore, std::chrono::milliseconds retry)
    : path_(path),
      folder_(path.substr(0, std::max<std::size_t>(path.rfind('/'), 1))),
      restore_(std::move(restore)),
      retry_(retry),
      events_(io),
      timer_(io, [this] { check(); }) {
  watch_folder();
}

// Without a watch the clock is what it goes by.
void SocketWatch::watch_folder() {
  constexpr std::uint32_t kEvents = IN_DELETE | IN_MOVED_FROM | IN_DELETE_SELF | IN_MOVE_SELF;
  const char* remedy = "to know at once: sudo sysctl fs.inotify.max_user_instances=1024";
  if (!events_.is_open()) {
    const int descriptor = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
    if (descriptor < 0) return watch_by_clock(remedy);
    events_.assign(descriptor);
    wait();
  }
  if (inotify_add_watch(events_.native_handle(), folder_.c_str(), kEvents) < 0) {
    if (errno == EACCES) remedy = "choose a path in a folder that it may read";
    if (errno == ENOSPC) remedy = "to know at once: sudo sysctl fs.inotify.max_user_watches=65536";
    return watch_by_clock(remedy);
  }
  is_told_ = false;
}

void SocketWatch::watch_by_clock(const char* remedy) {
  const char* why = std::strerror(errno);
  if (!std::exchange(is_told_, true)) {
    struct stat status {};
    const bool is_hidden = stat(path_.c_str(), &status) != 0 && errno == EACCES;
    const auto period_s = std::chrono::duration_cast<std::chrono::seconds>(retry_).count();
    log_of("daemon")->warn(
        "the kernel does not tell when the socket {} is deleted ({}), {}; {}", path_, why,
        is_hidden ? "and swarmtalkd may not look either, so it is not made again then"
                  : "so swarmtalkd looks every " + std::to_string(period_s) + " s",
        remedy);
  }
  timer_.after(retry_);
}

void SocketWatch::wait() {
  events_.async_wait(boost::asio::posix::stream_descriptor::wait_read,
                     [this](const boost::system::error_code& error) {
                       if (error) return;
                       on_events();
                       wait();
                     });
}

void SocketWatch::on_events() {
  alignas(inotify_event) std::array<char, 4096> bytes;
  while (read(events_.native_handle(), bytes.data(), bytes.size()) > 0) {
  }
  check();
}

void SocketWatch::check() {
  struct stat status {};
  const bool is_known = stat(path_.c_str(), &status) == 0 || errno == ENOENT || errno == ENOTDIR;
  const bool is_gone = is_known && !S_ISSOCK(status.st_mode);
  if (is_gone && !restore_()) return timer_.after(retry_);
  watch_folder();  // it may be a new one
}

}  // namespace swarmtalk::daemon
