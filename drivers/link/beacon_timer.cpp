#include "drivers/link/beacon_timer.hpp"

#include <random>

namespace swarmtalk::drivers {

void BeaconTimer::set_interval(std::chrono::milliseconds interval) {
  beacon_ = Beacon(interval, std::random_device{}());
  beacon_.silence_begins(std::chrono::steady_clock::now());
  timer_.cancel();
  if (has_started_ && beacon_.is_on()) arm();
}

void BeaconTimer::start() {
  has_started_ = true;
  if (beacon_.is_on()) arm();
}

void BeaconTimer::arm() {
  const Beacon::Time now = std::chrono::steady_clock::now();
  timer_.expires_at(now + beacon_.wait(now));
  timer_.async_wait(
      [this, alive = std::weak_ptr<bool>(alive_)](const boost::system::error_code& error) {
        if (alive.expired() || error || !beacon_.is_on()) return;
        const Beacon::Time then = std::chrono::steady_clock::now();
        if (beacon_.wait(then) == Beacon::Duration(0)) {
          beacon_.silence_begins(then);
          send_(then);
        }
        arm();
      });
}

}  // namespace swarmtalk::drivers
