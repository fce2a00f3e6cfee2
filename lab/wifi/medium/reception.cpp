#include "lab/wifi/medium/reception.hpp"

#include <array>
#include <cmath>

#include "sim/wifi_air_config.hpp"

namespace swarmtalk::wifi {
namespace {

constexpr std::array<Rate, 12> kRates{10, 20, 55, 110, 60, 90, 120, 180, 240, 360, 480, 540};
constexpr int kFirstOfdm = 4;
constexpr std::uint32_t kAbove24GhzMhz = 3000;
constexpr double kLossAtSensitivity = 0.1;
constexpr double kDbForTenth = 1.5;
constexpr double kDbForTenfoldDistance = 10 * sim::WifiAirConfig{}.path_exponent;
constexpr double kSlowestOfdmDbm = -82;
constexpr double kReferenceBytes = 1000;

}  // namespace

Rate rate_of(int index, std::uint32_t frequency_mhz) {
  const int first = frequency_mhz > kAbove24GhzMhz ? kFirstOfdm : 0;
  const int place = index + first;
  if (index < 0 || place >= static_cast<int>(kRates.size())) return 0;
  return kRates[static_cast<std::size_t>(place)];
}

double sensitivity_dbm(Rate rate) {
  for (const sim::WifiRate& ofdm : sim::wifi_rates()) {
    if (ofdm.mbps * 10 == rate) return kSlowestOfdmDbm + ofdm.more_db;
  }
  return rate == 10 ? -83 : rate == 20 ? -80 : rate == 55 ? -78 : -76;
}

double signal_dbm(double power_dbm, double distance_m, std::uint32_t frequency_mhz) {
  // Free space at 1 m: 20 log10(4 pi f / c), f in MHz.
  const double at_one_metre_db = 20 * std::log10(static_cast<double>(frequency_mhz)) - 27.55;
  const double beyond_db = distance_m > 1 ? kDbForTenfoldDistance * std::log10(distance_m) : 0;
  return power_dbm - at_one_metre_db - beyond_db;
}

double chance_of_reception(double signal, Rate rate, std::size_t bytes) {
  const double margin_db = signal - sensitivity_dbm(rate);
  const double errors_at_sensitivity = -std::log(1 - kLossAtSensitivity);
  const double errors = errors_at_sensitivity * std::pow(10.0, -margin_db / kDbForTenth) *
                        static_cast<double>(bytes) / kReferenceBytes;
  return std::exp(-errors);
}

}  // namespace swarmtalk::wifi
