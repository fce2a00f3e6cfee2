// BeaconTimer: calls when a link has been silent for so long that a beacon is due. Owned by the
// link, on its thread.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>
#include <utility>

#include "drivers/link/beacon.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::drivers {

class BeaconTimer {
 public:
  /// @param send  is called with the time when one is due; the silence begins to count again.
  ///   @return for how long it cannot leave yet; 0: it has, or need not
  using Send = std::function<Beacon::Duration(Beacon::Time)>;
  BeaconTimer(boost::asio::io_context& io, Send send)
      : send_(std::move(send)),
        beacon_(std::chrono::milliseconds(0), 1),
        timer_(io, [this] { on_time(); }) {}

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
  void on_time();

  Send send_;
  Beacon beacon_;
  loop::Timer timer_;
  bool has_started_ = false;
};

}  // namespace swarmtalk::drivers
