// What ARGoS's two robots differ in, for the programs and for what drives their wheels. No header
// of ARGoS is needed here, or in any other file of this folder that ends in .hpp but the three of
// the glue (controller.hpp, kilobot_controller.hpp, footbot_controller.hpp).
#pragma once

#include <cstdint>

#include "platforms/robot.hpp"
#include "platforms/sim/world_robot.hpp"
#include "swarmtalk/profiles/footbot.hpp"

namespace swarmtalk::platforms::in_argos {

constexpr uint32_t kStepsPerSecond = 31;  // of the simulation; programs count a Kilobot's ticks

/// Speeds of both wheels, as ARGoS takes them but in mm/s; left is the robot's left.
struct Wheels {
  double left_mm_per_s = 0;
  double right_mm_per_s = 0;
};

constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180;

/// ARGoS's Kilobot plugin: 25 mm between the legs, one of which it turns around.
struct KilobotModel {
  using Profile = ComparedProfile;
  static constexpr const char* kPlatform = "argos-kilobot";
  static constexpr uint16_t kBodyMm = kKilobotBodyMm;
  static constexpr uint16_t kSpeedMmPerS = 10;
  static constexpr uint16_t kTurnDegPerS = 45;
  static constexpr double kWheelBaseMm = 25;
  static constexpr double kTurnMmPerS = kTurnDegPerS * kRadiansPerDegree * kWheelBaseMm;
  static constexpr Wheels kAhead = {kSpeedMmPerS, kSpeedMmPerS};
  static constexpr Wheels kLeft = {0, kTurnMmPerS};
  static constexpr Wheels kRight = {kTurnMmPerS, 0};
  static Profile::Sensing sensing(int16_t distance_mm, double) { return {distance_mm}; }
};

/// The foot-bot: 140 mm between the wheels, which turn against each other.
struct FootbotModel {
  using Profile = core::Footbot;
  static constexpr const char* kPlatform = "argos-footbot";
  static constexpr uint16_t kBodyMm = 170;
  static constexpr uint16_t kSpeedMmPerS = 100;
  static constexpr uint16_t kTurnDegPerS = 90;
  static constexpr double kWheelBaseMm = 140;
  static constexpr double kTurnMmPerS = kTurnDegPerS * kRadiansPerDegree * kWheelBaseMm / 2;
  static constexpr Wheels kAhead = {kSpeedMmPerS, kSpeedMmPerS};
  static constexpr Wheels kLeft = {-kTurnMmPerS, kTurnMmPerS};
  static constexpr Wheels kRight = {kTurnMmPerS, -kTurnMmPerS};
  static Profile::Sensing sensing(int16_t distance_mm, double bearing_rad) {
    return {distance_mm, static_cast<float>(bearing_rad)};
  }
};

/// A measured distance as programs have it: whole mm, cut off at what fits and never wrapped;
/// unknown (-1) if it is not a number.
inline int16_t clamped_mm(double distance_mm) {
  if (!(distance_mm == distance_mm)) return -1;
  if (distance_mm <= 0) return 0;
  return distance_mm >= 32767 ? int16_t{32767} : static_cast<int16_t>(distance_mm + 0.5);
}

}  // namespace swarmtalk::platforms::in_argos
