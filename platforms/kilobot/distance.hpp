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

constexpr uint16_t kGapUnknown = 0xFFFF;

/// Millimetres between the bodies, in sixteenths, from one table whose entries fall.
/// @param read  entry i of the table, as a function of i
/// @return at most kFarMm * 16; kGapUnknown if the table is blank (0xFFFF) or does not fall
template <class ReadGain>
uint16_t gap_mm16(uint16_t gain, const ReadGain& read) {
  uint16_t above = read(uint8_t{0});
  if (above == 0xFFFF) return kGapUnknown;
  if (gain >= above) return 0;
  for (uint8_t i = 1; i < kGainEntries; ++i) {
    const uint16_t below = read(i);
    if (below >= above) return kGapUnknown;
    if (gain >= below) {
      const uint16_t step = static_cast<uint16_t>(above - below);
      const uint16_t part = static_cast<uint16_t>(above - gain);
      const uint16_t whole_mm = static_cast<uint16_t>((i - 1) * kGainStepMm);
      return static_cast<uint16_t>(whole_mm * 16u + (part * (kGainStepMm * 16u) + step / 2) / step);
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
  // Both count between the limits: the amplified one less and less as it nears saturation. Weights
  // of 0 to 40 keep the sum in 16 bits.
  constexpr uint8_t kWhole = (kHighTrusted - kLowTrusted) / 5;
  uint8_t high_weight = kWhole;
  if (high_gain >= kHighTrusted) {
    high_weight = 0;
  } else if (high_gain > kLowTrusted) {
    high_weight = static_cast<uint8_t>((kHighTrusted - high_gain + 4) / 5);
  }
  static_assert(uint32_t{kFarMm} * 16 * kWhole <= 0xFFFF, "the weighted sum overflows");
  uint16_t sum = 0;
  if (high_weight != 0) {
    const uint16_t gap = gap_mm16(high_gain, read_high);
    if (gap == kGapUnknown) return kDistanceUnknown;
    sum = static_cast<uint16_t>(gap * high_weight);
  }
  if (high_weight != kWhole) {
    const uint16_t gap = gap_mm16(low_gain, read_low);
    if (gap == kGapUnknown) return kDistanceUnknown;
    sum = static_cast<uint16_t>(sum + gap * static_cast<uint8_t>(kWhole - high_weight));
  }
  constexpr uint16_t kPerMm = kWhole * 16u;
  return static_cast<int16_t>(kBodyMm + (sum + kPerMm / 2u) / kPerMm);
}

}  // namespace kilobot
}  // namespace swarmtalk
