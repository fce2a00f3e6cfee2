// WakeTimer: wakes a link at a time, for what leaves then if nothing has left before. Owned by the
// link.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <memory>
#include <optional>

#include "drivers/link/link.hpp"

namespace swarmtalk::drivers {

class WakeTimer {
 public:
  explicit WakeTimer(boost::asio::io_context& io) : timer_(io) {}

  /// The link outlives this. It is woken at the earliest time that was asked for since it was woken
  /// last.
  void arm(MonotonicTime time, Link& link) {
    if (at_ && *at_ <= time) return;
    at_ = time;
    timer_.expires_at(time);
    timer_.async_wait(
        [this, &link, alive = std::weak_ptr<bool>(alive_)](const boost::system::error_code& error) {
          if (alive.expired() || error) return;
          at_.reset();
          link.wake();
        });
  }

 private:
  boost::asio::steady_timer timer_;
  std::optional<MonotonicTime> at_;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  // handlers outlive it
};

}  // namespace swarmtalk::drivers
