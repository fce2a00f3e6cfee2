// What a simulated world is made of: radio, clocks, bodies, and what goes wrong when. Lengths in
// mm, times in virtual us.
#pragma once

#include <cstdint>

#include "sim/body.hpp"

namespace swarmtalk::sim {

/// One tick of all robots' clocks, by the robot's own time: kilolib's 8 MHz / 1024 / 256.
constexpr uint32_t kTickUs = 32768;

struct RadioConfig {
  double range_mm = 75;
  double asymmetry = 0;          // a link reaches range * (1 +- up to this), each way for itself
  double loss = 0;               // share of receptions that fail, each by itself
  uint32_t air_us = 4600;        // one packet
  uint32_t period_us = 524288;   // between two turns of a robot, by its own clock
  double period_jitter = 0.05;   // each is longer or shorter by up to this share
  uint32_t turnaround_us = 300;  // a carrier is noticed so long after it began
  uint32_t backoff_us = 16000;   // longest wait after the air was found taken
  double distance_noise_mm = 1;  // standard deviation
  double bearing_noise_rad = 0;
};

/// Infrared, kilolib's two packets a second.
inline RadioConfig kilobot_radio() {
  return {};
}
/// Wi-Fi broadcast at 20 packets a second of one robot, poses by lighthouse: 0.2 mm.
inline RadioConfig coachbot_radio() {
  RadioConfig radio;
  radio.range_mm = 750;
  radio.air_us = 300;
  radio.period_us = 50000;
  radio.turnaround_us = 20;
  radio.backoff_us = 2000;
  radio.distance_noise_mm = 0.3;
  radio.bearing_noise_rad = 0.05;
  return radio;
}

struct ClockConfig {
  uint32_t drift_ppm = 5000;             // each clock is off by up to this
  uint32_t power_on_spread_us = 250000;  // each robot starts within this
};

struct Fault {
  enum class Kind : uint8_t {
    kDeath,      // `robot` falls silent
    kRestart,    // `robot` starts anew: node and program lose their memory
    kClockStep,  // `robot`'s clock jumps by `ticks`
    kPartition,  // until `end_us` nothing crosses the line x = x_mm
    kJam,        // until `end_us` nothing is received within radius_mm of (x_mm, y_mm)
  };
  Kind kind = Kind::kDeath;
  uint64_t at_us = 0;
  uint64_t end_us = 0;
  uint32_t robot = 0;
  int32_t ticks = 0;
  double x_mm = 0;
  double y_mm = 0;
  double radius_mm = 0;
};

/// What became of packets. `expected` counts each living robot in reach of each transmission, and
/// is the sum of the seven below it.
struct AirCounters {
  uint64_t sent = 0;
  uint64_t deferred = 0;  // a turn put off because the air was taken
  uint64_t expected = 0;
  uint64_t received = 0;
  uint64_t lost_collision = 0;
  uint64_t lost_while_sending = 0;  // a robot that sends hears nothing
  uint64_t lost_noise = 0;          // RadioConfig::loss
  uint64_t lost_jam = 0;
  uint64_t lost_partition = 0;
  uint64_t lost_death = 0;  // died or restarted while it received
  uint64_t contacts = 0;    // steps in which a moving body touched another
};

}  // namespace swarmtalk::sim
