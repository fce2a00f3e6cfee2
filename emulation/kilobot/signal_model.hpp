// How strong one Kilobot's light arrives at another, as counts of the 10-bit converter behind the
// two amplifiers, and the calibration tables that turn such counts back into a distance. The shape
// is a model of ours: straight lines that fall with distance, 6 counts per mm at high gain and 7 at
// low gain from 33 mm (two robots touching) on. There is no trace of real robots behind it; what it
// promises is that a robot with the tables below reads the true distance to 1 mm up to 98 mm.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace swarmtalk::emulator {

inline constexpr double kRobotDiameterMm = 33;
inline constexpr int kConverterMax = 1023;
inline constexpr int kHighGainAtContact = 1023;
inline constexpr int kLowGainAtContact = 900;
inline constexpr int kHighGainPerMm = 6;
inline constexpr int kLowGainPerMm = 7;
inline constexpr int kCalibrationStepMm = 5;
inline constexpr int kCalibrationEntries = 14;

struct SignalStrength {
  std::uint16_t high_gain = 0;  // counts, 0..1023
  std::uint16_t low_gain = 0;
};

/// @param distance_mm  between the centres of the two robots, >= 0
/// One count more than the line says: the robot's own integer arithmetic rounds down.
inline SignalStrength signal_at(double distance_mm) {
  const double past_contact_mm = std::max(0.0, distance_mm - kRobotDiameterMm);
  const auto counts = [&](int at_contact, int per_mm) {
    const auto value = static_cast<int>(std::lround(at_contact - per_mm * past_contact_mm)) + 1;
    return static_cast<std::uint16_t>(std::clamp(value, 1, kConverterMax));
  };
  return {counts(kHighGainAtContact, kHighGainPerMm), counts(kLowGainAtContact, kLowGainPerMm)};
}

/// The calibration tables' entry for kRobotDiameterMm + index * kCalibrationStepMm.
inline SignalStrength calibration_entry(int index) {
  const int past_contact_mm = index * kCalibrationStepMm;
  return {static_cast<std::uint16_t>(kHighGainAtContact - kHighGainPerMm * past_contact_mm),
          static_cast<std::uint16_t>(kLowGainAtContact - kLowGainPerMm * past_contact_mm)};
}

}  // namespace swarmtalk::emulator
