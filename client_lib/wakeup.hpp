// The one descriptor that an app's event loop watches: an epoll instance holding the socket, a
// timer and an eventfd to wake it. It outlives every connection. Owned by Engine.
#pragma once

#include <atomic>
#include <chrono>

namespace swarmtalk::client {

class Wakeup {
 public:
  using Clock = std::chrono::steady_clock;

  /// @throws std::system_error when the process is out of descriptors
  Wakeup();
  ~Wakeup();
  Wakeup(const Wakeup&) = delete;
  Wakeup& operator=(const Wakeup&) = delete;

  int fd() const { return epoll_fd_; }

  /// Watches `socket_fd`, for room to write too if `for_writing`. One socket at a time.
  void watch(int socket_fd, bool for_writing);
  /// Must be called before the socket is closed.
  void unwatch();

  void set_timer(Clock::time_point deadline);
  void clear_timer();
  /// True once when the timer has expired; it is then off.
  bool take_timer();

  /// Makes fd() readable until take_wake(). Any thread, also a signal handler.
  void wake();
  bool take_wake();

  /// Waits until something happens, or `deadline`. @return false: nothing has happened
  bool wait(Clock::time_point deadline) const;
  /// The same for socket and timer only.
  void wait_for_socket(Clock::time_point deadline) const;

 private:
  void close_all();

  int epoll_fd_ = -1;
  int timer_fd_ = -1;
  int wake_fd_ = -1;
  int socket_fd_ = -1;
  bool for_writing_ = false;
  bool is_timer_set_ = false;
  Clock::time_point timer_deadline_{};
  std::atomic<bool> is_woken_{false};
};

}  // namespace swarmtalk::client
