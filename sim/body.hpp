// A robot's body: a disc with two wheels on a plane. Owned by whoever moves it (the simulated
// world, or the lab in real time); single-threaded.
#pragma once

#include <cmath>

#include "sim/geometry.hpp"
#include "sim/random.hpp"

namespace swarmtalk::sim {

struct BodyConfig {
  double diameter_mm = 33;
  double wheel_base_mm = 12.7;  // one wheel alone at speed v turns v / wheel_base rad/s
  double speed_mm_per_s = 10;   // of a wheel at full
  double speed_bias = 0.05;     // standard deviation of a wheel's own speed, as a share; for good
  double motion_noise = 0.1;    // standard deviation of each step's speed, as a share
};

/// A Kilobot on its calibrated motors: 10 mm/s ahead, 45 degrees/s on one motor.
inline BodyConfig kilobot_body() {
  return {};
}
/// A Coachbot V2.0: 11 cm wide, geared wheels.
inline BodyConfig coachbot_body() {
  return {110, 90, 120, 0.01, 0.02};
}

class Body {
 public:
  Body() = default;
  Body(const BodyConfig& config, double x, double y, double theta, Random& random)
      : x_mm(x),
        y_mm(y),
        theta_rad(theta),
        left_gain_(1 + config.speed_bias * random.normal()),
        right_gain_(1 + config.speed_bias * random.normal()) {}

  /// Wheel speeds from now on, -1 to 1 of full.
  void drive(double left, double right) {
    left_ = left;
    right_ = right;
  }
  bool is_driving() const { return left_ != 0 || right_ != 0; }

  /// Moves on for `seconds` (short: a few hundredths).
  void advance(const BodyConfig& config, double seconds, Random& random) {
    const double left = speed(config, left_ * left_gain_, random);
    const double right = speed(config, right_ * right_gain_, random);
    const double turn = (right - left) / config.wheel_base_mm * seconds;
    const double way = (left + right) / 2 * seconds;
    // Half of the turn before the way, half after it: exact to second order.
    const double middle = theta_rad + turn / 2;
    x_mm += way * cosine(middle);
    y_mm += way * sine(middle);
    theta_rad = wrap(theta_rad + turn);
  }

  double x_mm = 0;
  double y_mm = 0;
  double theta_rad = 0;  // counter-clockwise from +x

 private:
  static double speed(const BodyConfig& config, double share, Random& random) {
    if (share == 0) return 0;
    return config.speed_mm_per_s * share * (1 + config.motion_noise * random.normal());
  }

  double left_gain_ = 1;
  double right_gain_ = 1;
  double left_ = 0;
  double right_ = 0;
};

/// Pushes `body` out of `other`, which stands. @return true if they had touched
inline bool push_apart(Body& body, const Body& other, double diameter_mm) {
  const double dx = body.x_mm - other.x_mm;
  const double dy = body.y_mm - other.y_mm;
  const double square = dx * dx + dy * dy;
  if (square >= diameter_mm * diameter_mm) return false;
  const double distance = std::sqrt(square);
  const double scale = distance > 1e-6 ? diameter_mm / distance : 0;
  body.x_mm = other.x_mm + (scale > 0 ? dx * scale : diameter_mm);
  body.y_mm = other.y_mm + dy * scale;
  return true;
}

}  // namespace swarmtalk::sim
