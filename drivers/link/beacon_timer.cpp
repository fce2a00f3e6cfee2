#include "drivers/link/beacon_timer.hpp"

#include "loop/chance.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::drivers {

void BeaconTimer::set_interval(std::chrono::milliseconds interval) {
  beacon_ = Beacon(interval, loop::random_bits());
  beacon_.silence_begins(loop::now());
  timer_.cancel();
  if (has_started_ && beacon_.is_on()) arm();
}

void BeaconTimer::start() {
  has_started_ = true;
  if (beacon_.is_on()) arm();
}

void BeaconTimer::arm() {
  const Beacon::Time now = loop::now();
  timer_.at(now + beacon_.wait(now));
}

void BeaconTimer::on_time() {
  const Beacon::Time now = loop::now();
  if (beacon_.wait(now) == Beacon::Duration(0)) {
    const Beacon::Duration wait = send_(now);
    if (wait > Beacon::Duration(0)) return timer_.at(now + wait);
    beacon_.silence_begins(now);
  }
  arm();
}

}  // namespace swarmtalk::drivers
