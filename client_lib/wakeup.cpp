#include "client_lib/wakeup.hpp"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <system_error>

#include "client_lib/descriptors.hpp"
#include "client_lib/waiting.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {

Wakeup::Wakeup() {
  epoll_fd_ = above_standard_streams(::epoll_create1(EPOLL_CLOEXEC));
  timer_fd_ = make_timer();
  wake_fd_ = above_standard_streams(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
  bool ok = epoll_fd_ >= 0 && timer_fd_ >= 0 && wake_fd_ >= 0;
  for (int fd : {timer_fd_, wake_fd_}) {
    epoll_event event{};
    event.events = EPOLLIN;
    ok = ok && ::epoll_ctl(epoll_fd_, EPOLL_CTL_ADD, fd, &event) == 0;
  }
  if (!ok) {
    const int error = errno;
    close_all();
    throw std::system_error(error, std::system_category(), "swarmtalk: cannot make an event loop");
  }
}

Wakeup::~Wakeup() {
  close_all();
}

void Wakeup::close_all() {
  if (timer_fd_ >= 0) close_timer(timer_fd_);
  for (const int fd : {epoll_fd_, wake_fd_}) {
    if (fd >= 0) ::close(fd);
  }
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
  client::set_timer(timer_fd_, deadline);
}

void Wakeup::clear_timer() {
  if (!is_timer_set_) return;
  is_timer_set_ = false;
  client::clear_timer(timer_fd_);
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
  return wait_for_epoll(epoll_fd_, deadline);
}

void Wakeup::wait_for_socket(Clock::time_point deadline) const {
  pollfd descriptors[2] = {{timer_fd_, POLLIN, 0}, {socket_fd_, POLLIN, 0}};
  if (for_writing_) descriptors[1].events |= POLLOUT;
  wait_for(descriptors, deadline);  // poll ignores a negative descriptor
}

}  // namespace swarmtalk::client
