#include "daemon/pose/ranging.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace swarmtalk::daemon {

Range Range::unknown() {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  return {kNaN, kNaN};
}

std::int16_t Range::distance_mm() const {
  if (!(distance_m >= 0.0f)) return -1;  // or NaN
  return static_cast<std::int16_t>(std::lround(std::min(distance_m * 1000.0f, 32766.0f)));
}

double wrap_angle(double angle_rad) {
  return std::remainder(angle_rad, 2.0 * std::numbers::pi);
}

Range range_to(const std::optional<OwnPose>& own, const std::optional<frame::FramePose>& other) {
  Range range = Range::unknown();
  if (!own || !other || other->is_stale()) return range;
  const double dx_m = other->x_m() - own->x_m;
  const double dy_m = other->y_m() - own->y_m;
  range.distance_m = static_cast<float>(std::hypot(dx_m, dy_m));
  if (range.distance_m > 0.0f) {
    range.bearing_rad = static_cast<float>(wrap_angle(std::atan2(dy_m, dx_m) - own->theta_rad));
  }
  return range;
}

}  // namespace swarmtalk::daemon
