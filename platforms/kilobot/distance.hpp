// Distance between two robots' centres from the strength of the light, by the tables that each
// robot was calibrated with. Pure logic.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint8_t kGainEntries = 14;  // a table: readings at 0, 5, ... 65 mm between the bodies
constexpr uint8_t kGainStepMm = 5;
constexpr uint8_t kBodyMm = 33;         // bodies that touch
constexpr uint8_t kFarMm = 90;          // between bodies: weaker than the last entry
constexpr uint16_t kHighTrusted = 900;  // above, the amplified reading saturates
constexpr uint16_t kLowTrusted = 700;   // below this amplified reading the other one is noise
constexpr int16_t kDistanceUnknown = -1;

/// Millimetres between the bodies, in sixteenths, from one table whose entries fall.
/// @param read      entry i of the table, as a function of i
/// @return kDistanceUnknown if the table is blank (0xFFFF) or does not fall
template <class ReadGain>
int16_t gap_mm16(uint16_t gain, const ReadGain& read) {
  uint16_t above = read(uint8_t{0});
  if (above == 0xFFFF) return kDistanceUnknown;
  if (gain >= above) return 0;
  for (uint8_t i = 1; i < kGainEntries; ++i) {
    const uint16_t below = read(i);
    if (below >= above) return kDistanceUnknown;
    if (gain >= below) {
      const uint16_t step = static_cast<uint16_t>(above - below);
      const uint16_t part = static_cast<uint16_t>(above - gain);
      return static_cast<int16_t>((i - 1) * kGainStepMm * 16 +
                                  (part * (kGainStepMm * 16u) + step / 2) / step);
    }
    above = below;
  }
  return kFarMm * 16;
}

/// Distance of the transmitter in mm, centre to centre, 33 to 123.
/// @param high_gain, low_gain  readings of the two amplifier stages, 0 to 1023
/// @param read_high, read_low  entries of the two tables
/// @return kDistanceUnknown on a robot without calibration
template <class ReadHigh, class ReadLow>
int16_t distance_mm(uint16_t high_gain, uint16_t low_gain, const ReadHigh& read_high,
                    const ReadLow& read_low) {
  int16_t high = 0;
  int16_t low = 0;
  if (high_gain < kHighTrusted) high = gap_mm16(high_gain, read_high);
  if (high_gain > kLowTrusted) low = gap_mm16(low_gain, read_low);
  if (high < 0 || low < 0) return kDistanceUnknown;
  int16_t gap = high;
  if (high_gain >= kHighTrusted) {
    gap = low;
  } else if (high_gain > kLowTrusted) {
    // Both count: the amplified one less and less as it nears saturation.
    const int32_t high_weight = kHighTrusted - high_gain;
    const int32_t low_weight = high_gain - kLowTrusted;
    gap = static_cast<int16_t>((high * high_weight + low * low_weight) /
                               (kHighTrusted - kLowTrusted));
  }
  return static_cast<int16_t>(kBodyMm + (static_cast<uint16_t>(gap) + 8u) / 16);
}

}  // namespace kilobot
}  // namespace swarmtalk
