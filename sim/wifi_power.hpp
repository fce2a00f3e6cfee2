// WifiPower: how strongly a frame of the Wi-Fi medium arrives, and what a receiver needs of it.
// Powers are multiples of the weakest that is received at 6 Mb/s. A value.
#pragma once

#include "sim/body.hpp"
#include "sim/wifi_air_config.hpp"

namespace swarmtalk::sim {

class WifiPower {
 public:
  WifiPower(const WifiAirConfig& config, const WifiRate& rate);

  /// What arrives of one at the other.
  double between(const Body& a, const Body& b) const;
  /// How far a frame disturbs.
  double reach_mm() const;
  double noise() const { return noise_; }

  /// Whether it arrives, with nobody else on the air.
  bool is_received(double power) const { return power >= needed_; }
  /// How much more it is than is needed.
  double margin_db(double power) const;
  /// Whether it counts at all; a weaker one neither arrives nor disturbs.
  bool disturbs(double power) const { return power >= unheard_; }
  /// Whether so much keeps a station silent, frame or not.
  bool is_busy(double power) const { return power >= energy_busy_; }

  // Of a power beside noise and all others' together.
  /// A preamble is noticed.
  bool is_detected(double ratio) const { return ratio >= needed_to_detect_; }
  /// The rest of the frame is read.
  bool is_readable(double ratio) const { return ratio >= needed_to_read_; }

 private:
  double range_mm_;
  double path_exponent_;
  double needed_;
  double needed_to_detect_;
  double needed_to_read_;
  double noise_;
  double energy_busy_;
  double unheard_;
};

}  // namespace swarmtalk::sim
