#include "client_lib/waiting.hpp"

#include <sys/epoll.h>
#include <sys/syscall.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <optional>

#include "client_lib/descriptors.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {
namespace {

using std::chrono::nanoseconds;
constexpr std::chrono::hours kLongestWait{1};  // fits every time_t; callers loop

nanoseconds left_until(WaitTime deadline) {
  return std::clamp<nanoseconds>(deadline - loop::now(), nanoseconds(0), kLongestWait);
}

#ifdef SYS_epoll_pwait2
/// What the system call takes, on every processor.
struct KernelTime {
  std::int64_t seconds;
  std::int64_t nanoseconds;
};

/// Without a second queue of waiters, which poll() of an epoll instance needs.
/// @return none: the kernel, or a filter of system calls, has no such call (Linux 5.11 has)
std::optional<bool> wait_directly(int epoll, WaitTime deadline) {
  static std::atomic<bool> is_missing{false};
  if (is_missing.load(std::memory_order_relaxed)) return std::nullopt;
  const std::int64_t left_ns = left_until(deadline).count();
  const KernelTime timeout{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  epoll_event event;
  const long count = syscall(SYS_epoll_pwait2, epoll, &event, 1, &timeout, nullptr, 0);
  if (count >= 0 || (errno != ENOSYS && errno != EPERM)) return count > 0;
  is_missing.store(true, std::memory_order_relaxed);
  return std::nullopt;
}
#else
std::optional<bool> wait_directly(int, WaitTime) {
  return std::nullopt;
}
#endif

}  // namespace

int make_timer() {
  return above_standard_streams(::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC));
}

void set_timer(int timer, WaitTime time) {
  const auto since_boot = std::max<std::int64_t>(
      1, std::chrono::duration_cast<nanoseconds>(time.time_since_epoch()).count());
  itimerspec when{};
  when.it_value.tv_sec = static_cast<time_t>(since_boot / 1'000'000'000);
  when.it_value.tv_nsec = static_cast<long>(since_boot % 1'000'000'000);
  ::timerfd_settime(timer, TFD_TIMER_ABSTIME, &when, nullptr);
}

void clear_timer(int timer) {
  const itimerspec off{};
  ::timerfd_settime(timer, 0, &off, nullptr);
}

void close_timer(int timer) {
  ::close(timer);
}

bool wait_for(std::span<pollfd> descriptors, WaitTime deadline) {
  const nanoseconds left = left_until(deadline);
  const timespec timeout{static_cast<time_t>(left.count() / 1'000'000'000),
                         static_cast<long>(left.count() % 1'000'000'000)};
  return ::ppoll(descriptors.data(), descriptors.size(), &timeout, nullptr) > 0;
}

bool wait_for_epoll(int epoll, WaitTime deadline) {
  if (const std::optional<bool> is_ready = wait_directly(epoll, deadline)) return *is_ready;
  pollfd descriptor{epoll, POLLIN, 0};
  return wait_for({&descriptor, 1}, deadline);
}

}  // namespace swarmtalk::client
