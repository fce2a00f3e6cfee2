// Distance and bearing of a transmitter, from its pose and ours. What cannot be known is NaN.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/pose/pose_keeper.hpp"
#include "frame/air_frame.hpp"

namespace swarmtalk::daemon {

/// Of the poses on the air: no distance is known more exactly.
inline constexpr double kPoseStepM = 0.001;

struct Range {
  float distance_m;   // NaN: unknown
  float bearing_rad;  // counter-clockwise from our heading, -pi..pi; NaN: unknown

  static Range unknown();

  /// Whole millimetres, at most 32766; -1: unknown. As the small profiles count.
  std::int16_t distance_mm() const;
};

/// Unknown when either pose is. At the very same place the distance is 0 and the bearing unknown.
Range range_to(const std::optional<OwnPose>& own, const std::optional<frame::FramePose>& other);

/// The same angle in -pi..pi.
double wrap_angle(double angle_rad);

}  // namespace swarmtalk::daemon
