// Distance between two robots' centres from the strength of the light, by the tables that each
// robot was calibrated with. Pure logic. The same millimetres as kilolib's estimate, bit by bit,
// for every table that it can use, so a limit in a program means the same on both.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint8_t kGainEntries = 14;  // a table: readings at 0, 5, ... 65 mm between the bodies
constexpr uint8_t kGainStepMm = 5;
constexpr uint8_t kBodyMm = 33;             // bodies that touch
constexpr uint8_t kFarMm = 90;              // between bodies: the plain reading is below its table
constexpr uint8_t kMostMm = 255 - kBodyMm;  // between bodies, in any case
constexpr uint16_t kHighTrusted = 900;      // from here on the amplified reading saturates
constexpr uint16_t kLowTrusted = 700;       // up to this amplified reading the other one is noise
constexpr int16_t kDistanceUnknown = -1;

/// A gap between two bodies, in mm.
constexpr uint16_t kGapUnknown = 0xFFFF;

/// The gap by one table, in whole mm, rounded down.
/// @param gain    a reading, 0 to 1023
/// @param read    an entry of the table, as a function of its number and of `table`
/// @param beyond  the gap of a reading below the table; 0: as the table's last step goes on
/// @return at most kMostMm; kGapUnknown if the table is blank (0xFFFF) or the step that counts does
///         not fall
template <class Table, class Read>
uint16_t gap_mm(uint16_t gain, Table table, const Read& read, uint8_t beyond) {
  uint16_t above = read(table, uint8_t{0});
  if (above == 0xFFFF) return kGapUnknown;
  if (gain > above) return 0;
  uint8_t i = 1;
  uint16_t below;
  while (below = read(table, i), gain <= below && i < kGainEntries - 1) {
    above = below;
    ++i;
  }
  if (gain <= below && beyond != 0) return beyond;
  if (below >= above) return kGapUnknown;
  // At most 5 * 1023, for readings of a converter of 10 bits.
  const uint16_t past = static_cast<uint16_t>(static_cast<uint16_t>(above - gain) * kGainStepMm /
                                              static_cast<uint16_t>(above - below));
  const uint16_t gap = static_cast<uint16_t>(past + static_cast<uint8_t>(i - 1) * kGainStepMm);
  return gap > kMostMm ? uint16_t{kMostMm} : gap;
}

/// Distance of the transmitter in mm, centre to centre, 33 to 255.
/// @param high_gain, low_gain    readings of the two amplifier stages, 0 to 1023
/// @param high_table, low_table  the tables of the two, as `read` knows them
/// @param read                   an entry, 0 to kGainEntries - 1, of a table
/// @return kDistanceUnknown on a robot without calibration
template <class Table, class Read>
int16_t distance_mm(uint16_t high_gain, uint16_t low_gain, Table high_table, Table low_table,
                    const Read& read) {
  // Both count between the limits: the amplified one less and less as it nears saturation.
  constexpr uint8_t kWhole = kHighTrusted - kLowTrusted;
  static_assert(uint32_t{kMostMm} * kWhole <= 0xFFFF, "the weighted sum overflows");
  uint8_t weight = kWhole;
  if (high_gain >= kHighTrusted) {
    weight = 0;
  } else if (high_gain > kLowTrusted) {
    weight = static_cast<uint8_t>(kHighTrusted - high_gain);
  }
  uint16_t sum = 0;
  uint16_t gain = high_gain;
  Table table = high_table;
  for (uint8_t beyond = 0;; beyond = kFarMm) {  // one call in the code: the walk is inlined here
    if (weight != 0) {
      const uint16_t gap = gap_mm(gain, table, read, beyond);
      if (gap == kGapUnknown) return kDistanceUnknown;
      sum = static_cast<uint16_t>(sum + gap * weight);
    }
    if (beyond != 0) break;
    weight = static_cast<uint8_t>(kWhole - weight);
    gain = low_gain;
    table = low_table;
  }
  return static_cast<int16_t>(kBodyMm + sum / kWhole);
}

}  // namespace kilobot
}  // namespace swarmtalk
