// The text form of a pose, as it comes in datagrams: "x y theta", metres and radians, and an age in
// seconds behind it if its writer knows one.
#pragma once

#include <optional>
#include <string_view>

namespace swarmtalk::daemon {

inline constexpr std::size_t kMaxPoseTextBytes = 256;

struct PoseText {
  double x_m = 0.0;
  double y_m = 0.0;
  double theta_rad = 0.0;
  double age_s = 0.0;
};

/// Three or four finite decimal numbers between blanks; the fourth at least 0. Nothing else: no
/// locale, no hexadecimal, no rest. @return none: it is not a pose
std::optional<PoseText> parse_pose_text(std::string_view text);

}  // namespace swarmtalk::daemon
