#include "daemon/host/socket_watch.hpp"

#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <utility>

namespace swarmtalk::daemon {
namespace {

constexpr auto kRetry = std::chrono::seconds(5);

}  // namespace

SocketWatch::SocketWatch(boost::asio::io_context& io, const std::string& path,
                         std::function<bool()> restore)
    : path_(path),
      folder_(path.substr(0, std::max<std::size_t>(path.rfind('/'), 1))),
      restore_(std::move(restore)),
      events_(io),
      timer_(io) {
  const int descriptor = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (descriptor < 0) return;  // out of descriptors: as before, unnoticed
  events_.assign(descriptor);
  watch_folder();
  wait();
}

void SocketWatch::watch_folder() {
  constexpr std::uint32_t kEvents = IN_DELETE | IN_MOVED_FROM | IN_DELETE_SELF | IN_MOVE_SELF;
  is_watching_ = inotify_add_watch(events_.native_handle(), folder_.c_str(), kEvents) >= 0;
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
  const bool is_there = stat(path_.c_str(), &status) == 0 && S_ISSOCK(status.st_mode);
  if (!is_there && !restore_()) return check_later();
  watch_folder();  // it may be a new one
  if (!is_watching_) check_later();
}

void SocketWatch::check_later() {
  timer_.expires_after(kRetry);
  timer_.async_wait([this](const boost::system::error_code& error) {
    if (!error) check();
  });
}

}  // namespace swarmtalk::daemon
