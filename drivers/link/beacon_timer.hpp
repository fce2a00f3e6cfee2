// BeaconTimer: calls when a link has been silent for so long that a beacon is due. Owned by the
// link, on its thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <chrono>
#include <functional>
#include <memory>
#include <utility>

#include "drivers/link/beacon.hpp"

namespace swarmtalk::drivers {

class BeaconTimer {
 public:
  /// @param send  is called with the time when one is due; the silence begins to count again
  BeaconTimer(boost::asio::io_context& io, std::function<void(Beacon::Time)> send)
      : send_(std::move(send)), beacon_(std::chrono::milliseconds(0), 1), timer_(io) {}

  /// Longest silence, from now on. 0, as at first: no beacons.
  void set_interval(std::chrono::milliseconds interval);

  /// Nothing is called before.
  void start();

  /// A frame left.
  void silence_begins(Beacon::Time now) {
    if (beacon_.is_on()) beacon_.silence_begins(now);
  }

 private:
  void arm();

  std::function<void(Beacon::Time)> send_;
  Beacon beacon_;
  boost::asio::steady_timer timer_;
  bool has_started_ = false;
  std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);  // handlers outlive it
};

}  // namespace swarmtalk::drivers
