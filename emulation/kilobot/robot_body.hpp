// RobotBody: what one sees of a Kilobot from outside: the colour of its LED and how it moves.
// Reads the processor's output registers; a model, not a mechanism (docs/kilobot-emulator.md).
#pragma once

#include <cstdint>

#include "emulation/kilobot/mcu.hpp"

namespace swarmtalk::emulator {

struct LedColour {
  std::uint8_t red = 0, green = 0, blue = 0;  // 0..3
  bool operator==(const LedColour&) const = default;
};

struct MotorDuty {
  std::uint8_t left = 0, right = 0;  // 0..255
  bool operator==(const MotorDuty&) const = default;
};

struct BodyPose {
  double x_mm = 0, y_mm = 0, theta_rad = 0;  // counter-clockwise from the x axis
};

/// Each colour has two resistors to ground, switched on as outputs: red PD5 and PD4, green PC3 and
/// PC2, blue PC5 and PC4; the first of each pair counts one, the second two.
LedColour read_led(const Mcu& mcu);

/// The duty of the two motor pins: left OC2A (PB3), right OC2B (PD3). That is kilolib's convention,
/// in which the motor of its first argument, alone, turns the robot left.
MotorDuty read_motors(const Mcu& mcu);

/// What each motor makes of its duty, as a share of the nominal speed.
struct MotorGain {
  double left = 1, right = 1;
};

/// Moves a pose on as a real robot would at this duty: below kMotorThreshold a motor does not
/// overcome friction; both together drive forwards, each alone turns about the other leg.
BodyPose move(const BodyPose& pose, const MotorDuty& duty, double seconds,
              const MotorGain& gain = {});

inline constexpr int kMotorThreshold = 30;              // duty
inline constexpr double kNominalDuty = 65;              // at which a robot drives straight
inline constexpr double kForwardMmPerS = 10;            // K-Team, Kilobot user manual: 1 cm/s
inline constexpr double kTurnRadPerS = 0.785398163397;  // the same: 45 degrees/s

}  // namespace swarmtalk::emulator
