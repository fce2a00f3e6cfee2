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
constexpr uint16_t kHighTrusted = 896;  // above, the amplified reading saturates
constexpr uint16_t kLowTrusted = 768;   // below this amplified reading the other one is noise
constexpr int16_t kDistanceUnknown = -1;

/// A gap between two bodies is counted in sixteenths of a millimetre.
constexpr uint16_t kGapPerMm = 16;
constexpr uint16_t kGapUnknown = 0xFFFF;

/// The gap by one table, whose entries fall.
/// @param gain  a reading, 0 to 1023
/// @param read  an entry of the table, as a function of its number and of `table`
/// @return at most kFarMm * kGapPerMm, exact to a sixteenth; kGapUnknown if the table is blank
///         (0xFFFF) or does not fall
template <class Table, class Read>
uint16_t gap_mm16(uint16_t gain, Table table, const Read& read) {
  constexpr uint8_t kStep = kGainStepMm * kGapPerMm;
  uint16_t above = read(table, uint8_t{0});
  if (above == 0xFFFF) return kGapUnknown;
  if (gain >= above) return 0;
  uint16_t gap = 0;
  for (uint8_t i = 1; i < kGainEntries; ++i) {
    const uint16_t below = read(table, i);
    if (below >= above) return kGapUnknown;
    if (gain >= below)
      return static_cast<uint16_t>(gap + static_cast<uint16_t>((above - gain) * kStep) /
                                             static_cast<uint16_t>(above - below));
    above = below;
    gap = static_cast<uint16_t>(gap + kStep);
  }
  return kFarMm * kGapPerMm;
}

/// Distance of the transmitter in mm, centre to centre, 33 to 123.
/// @param high_gain, low_gain    readings of the two amplifier stages, 0 to 1023
/// @param high_table, low_table  the tables of the two, as `read` knows them
/// @param read                   an entry, 0 to kGainEntries - 1, of a table
/// @return kDistanceUnknown on a robot without calibration
template <class Table, class Read>
int16_t distance_mm(uint16_t high_gain, uint16_t low_gain, Table high_table, Table low_table,
                    const Read& read) {
  // Both count between the limits: the amplified one less and less as it nears saturation. The
  // weights add up to a power of two and keep the sum in 16 bits.
  constexpr uint8_t kWhole = (kHighTrusted - kLowTrusted) / 4;
  constexpr uint16_t kPerMm = kWhole * kGapPerMm;
  static_assert((kPerMm & (kPerMm - 1)) == 0, "the mean is a shift");
  static_assert(uint32_t{kFarMm} * kPerMm + kPerMm / 2 <= 0xFFFF, "the weighted sum overflows");
  uint8_t weight = kWhole;
  if (high_gain >= kHighTrusted) {
    weight = 0;
  } else if (high_gain > kLowTrusted) {
    weight = static_cast<uint8_t>(static_cast<uint8_t>(kHighTrusted - high_gain) / 4);
  }
  uint16_t sum = kPerMm / 2;
  uint16_t gain = high_gain;
  Table table = high_table;
  for (uint8_t i = 0; i < 2; ++i) {  // one call in the code: the walk is inlined here
    if (weight != 0) {
      const uint16_t gap = gap_mm16(gain, table, read);
      if (gap == kGapUnknown) return kDistanceUnknown;
      sum = static_cast<uint16_t>(sum + gap * weight);
    }
    weight = static_cast<uint8_t>(kWhole - weight);
    gain = low_gain;
    table = low_table;
  }
  return static_cast<int16_t>(kBodyMm + sum / kPerMm);
}

}  // namespace kilobot
}  // namespace swarmtalk
