// Fuzz target: any bytes as a datagram on the pose socket. What is taken is finite, and reads the
// same when it is written down again.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "daemon/pose/pose_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace swarmtalk::daemon;
  const auto pose = parse_pose_text({reinterpret_cast<const char*>(bytes), size});
  if (!pose) return 0;
  const bool is_finite = std::isfinite(pose->x_m) && std::isfinite(pose->y_m) &&
                         std::isfinite(pose->theta_rad) && std::isfinite(pose->age_s);
  if (!is_finite || pose->age_s < 0.0 || size > kMaxPoseTextBytes) std::abort();
  char text[kMaxPoseTextBytes];
  const int length = std::snprintf(text, sizeof text, "%.17g %.17g %.17g %.17g", pose->x_m,
                                   pose->y_m, pose->theta_rad, pose->age_s);
  const auto again = parse_pose_text({text, static_cast<std::size_t>(length)});
  const bool is_same = again && again->x_m == pose->x_m && again->y_m == pose->y_m &&
                       again->theta_rad == pose->theta_rad && again->age_s == pose->age_s;
  if (!is_same) std::abort();
  return 0;
}
