// WakeTimer: wakes a link at a time, for what leaves then if nothing has left before. Owned by the
// link.
#pragma once

#include <boost/asio/io_context.hpp>
#include <optional>

#include "drivers/link/link.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::drivers {

class WakeTimer {
 public:
  /// The link outlives this.
  WakeTimer(boost::asio::io_context& io, Link& link)
      : timer_(io, [this, &link] {
          at_.reset();
          link.wake();
        }) {}

  /// The link is woken at the earliest time that was asked for since it was woken last.
  void arm(MonotonicTime time) {
    if (at_ && *at_ <= time) return;
    at_ = time;
    timer_.at(time);
  }

 private:
  loop::Timer timer_;
  std::optional<MonotonicTime> at_;
};

}  // namespace swarmtalk::drivers
