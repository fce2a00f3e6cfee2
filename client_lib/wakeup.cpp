#include "client_lib/wakeup.hpp"

#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <optional>
#include <system_error>

#include "client_lib/descriptors.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {
namespace {

using std::chrono::nanoseconds;
constexpr std::chrono::hours kLongestWait{1};  // fits every time_t; callers loop

nanoseconds left_until(Wakeup::Clock::time_point deadline) {
  return std::clamp<nanoseconds>(deadline - loop::now(), nanoseconds(0), kLongestWait);
}

/// @return false: none is ready
bool poll_until(pollfd* descriptors, nfds_t count, Wakeup::Clock::time_point deadline) {
  const nanoseconds left = left_until(deadline);
  const timespec timeout{static_cast<time_t>(left.count() / 1'000'000'000),
                         static_cast<long>(left.count() % 1'000'000'000)};
  // A signal ends the wait early; callers loop.
  return ::ppoll(descriptors, count, &timeout, nullptr) > 0;
}

#ifdef SYS_epoll_pwait2
/// What the system call takes, on every processor.
struct KernelTime {
  std::int64_t seconds;
  std::int64_t nanoseconds;
};

/// Without a second queue of waiters, which poll() of an epoll instance needs.
/// @return none: the kernel, or a filter of system calls, has no such call (Linux 5.11 has)
std::optional<bool> wait_directly(int epoll_fd, Wakeup::Clock::time_point deadline) {
  static std::atomic<bool> is_missing{false};
  if (is_missing.load(std::memory_order_relaxed)) return std::nullopt;
  const std::int64_t left_ns = left_until(deadline).count();
  const KernelTime timeout{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  epoll_event event;
  const long count = syscall(SYS_epoll_pwait2, epoll_fd, &event, 1, &timeout, nullptr, 0);
  if (count >= 0 || (errno != ENOSYS && errno != EPERM)) return count > 0;
  is_missing.store(true, std::memory_order_relaxed);
  return std::nullopt;
}
#else
std::optional<bool> wait_directly(int, Wakeup::Clock::time_point) {
  return std::nullopt;
}
#endif

}  // namespace

Wakeup::Wakeup() {
  epoll_fd_ = above_standard_streams(::epoll_create1(EPOLL_CLOEXEC));
  timer_fd_ = above_standard_streams(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
  wake_fd_ = above_standard_streams(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  bool ok = epoll_fd_ >= 0 && timer_fd_ >= 0 && wake_fd_ >= 0;
  for (int fd : {timer_fd_, wake_fd_}) {
    epoll_event event{};
    event.events = EPOLLIN;
    ok = ok && ::epoll_ctl(epoll_fd_, EPOLL_CTL_ADD, fd, &event) == 0;
  }
  if (!ok) {
    const int error = errno;
    for (int fd : {epoll_fd_, timer_fd_, wake_fd_}) {
      if (fd >= 0) ::close(fd);
    }
    throw std::system_error(error, std::system_category(), "swarmtalk: cannot make an event loop");
  }
}

Wakeup::~Wakeup() {
  for (int fd : {epoll_fd_, timer_fd_, wake_fd_}) ::close(fd);
}

void Wakeup::watch(int socket_fd, bool for_writing) {
  if (socket_fd == socket_fd_ && for_writing == for_writing_) return;
  epoll_event event{};
  event.events = EPOLLIN | (for_writing ? EPOLLOUT : 0u);
  ::epoll_ctl(epoll_fd_, socket_fd == socket_fd_ ? EPOLL_CTL_MOD : EPOLL_CTL_ADD, socket_fd,
              &event);
  socket_fd_ = socket_fd;
  for_writing_ = for_writing;
}

void Wakeup::unwatch() {
  if (socket_fd_ >= 0) ::epoll_ctl(epoll_fd_, EPOLL_CTL_DEL, socket_fd_, nullptr);
  socket_fd_ = -1;
}

void Wakeup::set_timer(Clock::time_point deadline) {
  is_timer_set_ = true;
  timer_deadline_ = deadline;
  const auto since_boot = std::max<std::int64_t>(
      1, std::chrono::duration_cast<nanoseconds>(deadline.time_since_epoch()).count());
  itimerspec when{};
  when.it_value.tv_sec = static_cast<time_t>(since_boot / 1'000'000'000);
  when.it_value.tv_nsec = static_cast<long>(since_boot % 1'000'000'000);
  ::timerfd_settime(timer_fd_, TFD_TIMER_ABSTIME, &when, nullptr);
}

void Wakeup::clear_timer() {
  if (!is_timer_set_) return;
  is_timer_set_ = false;
  const itimerspec off{};
  ::timerfd_settime(timer_fd_, 0, &off, nullptr);
}

bool Wakeup::take_timer() {
  if (!is_timer_set_ || loop::now() < timer_deadline_) return false;
  clear_timer();
  return true;
}

void Wakeup::wake() {
  // First the eventfd, then the note of it: take_wake() must never see the note without the
  // eventfd, or the descriptor would stay readable for ever.
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t count = ::write(wake_fd_, &one, sizeof(one));
  is_woken_.store(true);
}

bool Wakeup::take_wake() {
  if (!is_woken_.load() || !is_woken_.exchange(false)) return false;
  std::uint64_t value = 0;
  [[maybe_unused]] const ssize_t count = ::read(wake_fd_, &value, sizeof(value));
  return true;
}

bool Wakeup::wait(Clock::time_point deadline) const {
  if (const std::optional<bool> has_happened = wait_directly(epoll_fd_, deadline)) {
    return *has_happened;
  }
  pollfd descriptor{epoll_fd_, POLLIN, 0};
  return poll_until(&descriptor, 1, deadline);
}

void Wakeup::wait_for_socket(Clock::time_point deadline) const {
  pollfd descriptors[2] = {{timer_fd_, POLLIN, 0}, {socket_fd_, POLLIN, 0}};
  if (for_writing_) descriptors[1].events |= POLLOUT;
  poll_until(descriptors, 2, deadline);  // poll ignores a negative descriptor
}

}  // namespace swarmtalk::client
