// Sine, cosine and arc tangent of our own: only +, -, *, / and sqrt, which IEEE 754 fixes to the
// bit, so that positions do not depend on the compiler or its library. Errors below 1e-9.
#pragma once

#include <cmath>

namespace swarmtalk::sim {

constexpr double kPi = 3.14159265358979323846;

/// `angle` brought into (-pi, pi]; at most a few turns away from it.
inline double wrap(double angle) {
  while (angle > kPi) angle -= 2 * kPi;
  while (angle <= -kPi) angle += 2 * kPi;
  return angle;
}

/// @param angle  rad, within a few turns
inline double sine(double angle) {
  angle = wrap(angle);
  if (angle > kPi / 2) angle = kPi - angle;
  if (angle < -kPi / 2) angle = -kPi - angle;
  const double s = angle * angle;
  // Taylor series to x^17: the next term is below 5e-14 at pi / 2.
  double sum = 1;
  for (int n = 16; n >= 2; n -= 2) sum = 1 - sum * s / (n * (n + 1));
  return angle * sum;
}

inline double cosine(double angle) {
  return sine(wrap(angle) + kPi / 2);
}

/// Angle of (x, y) from +x, counter-clockwise, in (-pi, pi]; 0 for (0, 0).
inline double angle_of(double y, double x) {
  const double size = std::sqrt(x * x + y * y);
  if (!(size > 0)) return 0;
  // Newton on sin(a - angle) from a guess that is right to 0.3 rad: each step cubes the error.
  const double ax = std::fabs(x) / size;
  const double ay = std::fabs(y) / size;
  double angle = ay / (ax + ay) * (kPi / 2);
  for (int i = 0; i < 3; ++i) angle += ay * cosine(angle) - ax * sine(angle);
  if (x < 0) angle = kPi - angle;
  return y < 0 ? -angle : angle;
}

}  // namespace swarmtalk::sim
