// client_lib/waiting.hpp in a virtual swarm: a wait lets the time pass until something is ready.
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>

#include "client_lib/waiting.hpp"
#include "loop/clock.hpp"
#include "loop/timer.hpp"
#include "tests/support/turned_clock.hpp"
#include "tests/virtual/swarm.hpp"

namespace swarmtalk::client {
namespace {

std::map<int, std::unique_ptr<loop::Timer>>& timers() {
  static std::map<int, std::unique_ptr<loop::Timer>> all;
  return all;
}

bool is_ready(std::span<pollfd> descriptors) {
  return ::poll(descriptors.data(), descriptors.size(), 0) > 0;
}

}  // namespace

int make_timer() {
  const int timer = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  timers()[timer] = std::make_unique<loop::Timer>(test::Swarm::present()->io(), [timer] {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t count = ::write(timer, &one, sizeof one);
  });
  return timer;
}

void set_timer(int timer, WaitTime time) {
  clear_timer(timer);
  timers().at(timer)->at(time);
}

void clear_timer(int timer) {
  timers().at(timer)->cancel();
  std::uint64_t value = 0;
  [[maybe_unused]] const ssize_t count = ::read(timer, &value, sizeof value);
}

void close_timer(int timer) {
  timers().erase(timer);
  ::close(timer);
}

bool wait_for(std::span<pollfd> descriptors, WaitTime deadline) {
  constexpr std::chrono::hours kLongest(1);  // callers wait again
  const auto left = std::clamp<std::chrono::nanoseconds>(deadline - loop::now(),
                                                         std::chrono::nanoseconds(0), kLongest);
  return test::Swarm::present()->run_daemons([&] { return is_ready(descriptors); }, left);
}

bool wait_for_epoll(int epoll, WaitTime deadline) {
  pollfd descriptor{epoll, POLLIN, 0};
  return wait_for({&descriptor, 1}, deadline);
}

}  // namespace swarmtalk::client
