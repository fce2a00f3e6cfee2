#include "tests/virtual/machine.hpp"

#include <sys/epoll.h>

#include <map>
#include <utility>

#include "tests/support/turned_clock.hpp"

namespace swarmtalk::test {

namespace {

using Names = std::map<const boost::asio::io_context*, std::string>;

Names& names() {
  static Names all;
  return all;
}

}  // namespace

Machine::Machine(int machines, std::string name) : machines_(machines) {
  names()[&io_] = std::move(name);
  set_running(true);
}

Machine::~Machine() {
  set_running(false);
  names().erase(&io_);
}

std::string Machine::present_name() {
  const auto found = names().find(entered_machine());
  return found == names().end() ? "" : found->second;
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
