#include "tests/virtual/machine.hpp"

#include <sys/epoll.h>

#include <utility>

#include "tests/support/turned_clock.hpp"

namespace swarmtalk::test {

Machine::Machine(int machines) : machines_(machines) {
  set_running(true);
}

Machine::~Machine() {
  set_running(false);
}

void Machine::set_running(bool is_running) {
  if (std::exchange(is_running_, is_running) == is_running) return;
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = this;
  ::epoll_ctl(machines_, is_running ? EPOLL_CTL_ADD : EPOLL_CTL_DEL, loop_.descriptor(), &event);
  hold_timers(io_, !is_running);
}

void Machine::turn() {
  enter(io_);
  drive_.turn();
}

}  // namespace swarmtalk::test
