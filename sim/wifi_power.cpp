#include "sim/wifi_power.hpp"

#include <algorithm>
#include <cmath>

namespace swarmtalk::sim {
namespace {

double ratio(double decibels) {
  return std::pow(10, decibels / 10);
}

}  // namespace

WifiPower::WifiPower(const WifiAirConfig& config, const WifiRate& rate)
    : range_mm_(config.range_mm),
      path_exponent_(config.path_exponent),
      needed_(ratio(rate.more_db)),
      needed_to_detect_(ratio(config.detection_db)),
      needed_to_read_(ratio(config.payload_db + rate.more_db)),
      noise_(ratio(config.noise_db)),
      energy_busy_(ratio(config.energy_busy_db)),
      unheard_(ratio(config.unheard_db)) {}

double WifiPower::between(const Body& a, const Body& b) const {
  const double dx = a.x_mm - b.x_mm;
  const double dy = a.y_mm - b.y_mm;
  // Two antennas are never in the same place.
  const double distance_mm = std::max(std::sqrt(dx * dx + dy * dy), range_mm_ / 1000);
  return std::pow(range_mm_ / distance_mm, path_exponent_);
}

double WifiPower::reach_mm() const {
  return range_mm_ * std::pow(unheard_, -1 / path_exponent_);
}

double WifiPower::margin_db(double power) const {
  return 10 * std::log10(power / needed_);
}

}  // namespace swarmtalk::sim
