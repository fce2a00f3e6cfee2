#include "drivers/link/beacon.hpp"

namespace swarmtalk::drivers {

Beacon::Beacon(std::chrono::milliseconds interval, std::uint64_t seed)
    : interval_(interval), random_(static_cast<std::minstd_rand::result_type>(seed)) {}

Beacon::Duration Beacon::draw() {
  std::uniform_int_distribution<Duration::rep> less(0, interval_.count() / 4);
  return interval_ - Duration(less(random_));
}

}  // namespace swarmtalk::drivers
