#include "daemon/pose/pose_keeper.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "daemon/common/logging.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::uint32_t kOldestOnAirMs = frame::FramePose::kOldest * 10u;
constexpr double kWholeTurnRad = 2 * std::numbers::pi + 1e-3;  // and what rounding adds to one

}  // namespace

PoseKeeper::PoseKeeper(const NodeConfig& config)
    : pose_(config.pose), max_age_ms_(config.pose_max_age_ms) {}

bool PoseKeeper::set(double x_m, double y_m, double theta_rad, std::optional<Time> known_at,
                     std::string_view told_by) {
  const bool is_inside = std::abs(x_m) <= kMaxPoseM && std::abs(y_m) <= kMaxPoseM;  // no NaN
  if (!is_inside || !std::isfinite(theta_rad)) return false;
  tell_whole_turns(theta_rad);
  pose_ = FixedPose{x_m, y_m, std::fmod(theta_rad, 2 * std::numbers::pi)};
  set_at_ = known_at;
  told_by_ = told_by;
  return true;
}

void PoseKeeper::tell_whole_turns(double theta_rad) {
  if (has_told_whole_turns_ || std::abs(theta_rad) <= kWholeTurnRad) return;
  has_told_whole_turns_ = true;
  log_of("daemon")->warn(
      "a pose has theta {:g}, more than a whole turn in radians; its whole turns are left out. If "
      "it is degrees, let the program that tells it divide by 57.29578 (this is said only once)",
      theta_rad);
}

void PoseKeeper::forget(const FixedPose& pose) {
  if (!set_at_ && pose_ == pose) pose_.reset();
}

std::optional<std::uint32_t> PoseKeeper::age_ms(Time now) const {
  if (!pose_) return std::nullopt;
  if (!set_at_) return 0;
  const auto age = std::chrono::duration_cast<std::chrono::milliseconds>(now - *set_at_).count();
  const std::int64_t most = std::numeric_limits<std::uint32_t>::max();
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(age, 0, most));
}

std::optional<OwnPose> PoseKeeper::valid(Time now) const {
  const auto age = age_ms(now);
  if (!age || (max_age_ms_ != 0 && *age > max_age_ms_)) return std::nullopt;
  return OwnPose{pose_->x_m, pose_->y_m, pose_->theta_rad, *age};
}

std::optional<frame::FramePose> PoseKeeper::on_air(Time now) const {
  if (!pose_) return std::nullopt;
  const auto own = valid(now);
  if (!own) return frame::FramePose::stale();
  return frame::FramePose::from_metres(own->x_m, own->y_m, own->theta_rad, own->age_ms / 1000.0);
}

bool PoseKeeper::is_usable(const frame::FramePose& pose) const {
  if (pose.is_stale()) return false;
  // "2540 ms or more" may be within a longer limit: then the transmitter's own limit decides.
  return max_age_ms_ == 0 || max_age_ms_ >= kOldestOnAirMs || pose.age_10ms * 10u <= max_age_ms_;
}

}  // namespace swarmtalk::daemon
