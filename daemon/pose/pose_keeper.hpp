// PoseKeeper: where this robot is, as the configuration or a client said last, and how old that is.
// A pose of the configuration is fixed, and a client may set a fixed one: it has no age until a
// client sets another.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/config/config.hpp"
#include "frame/air_frame.hpp"

namespace swarmtalk::daemon {

struct OwnPose {
  double x_m = 0.0;
  double y_m = 0.0;
  double theta_rad = 0.0;
  std::uint32_t age_ms = 0;
};

class PoseKeeper {
 public:
  using Time = std::chrono::steady_clock::time_point;

  static constexpr std::string_view kConfiguration = "the configuration";

  explicit PoseKeeper(const NodeConfig& config);

  /// The configuration has changed.
  void set_max_age_ms(std::uint32_t max_age_ms) { max_age_ms_ = max_age_ms; }

  /// @param theta_rad  any finite angle, since a program may sum up turns; kept without the whole
  ///   ones, -2 pi to 2 pi. The first beyond that is told in the log: it may be degrees
  /// @param known_at  from when it ages; none: it is fixed
  /// @param told_by  whoever it comes from, for people
  /// @return false, and nothing changed: not finite, or outside +-32.767 m
  bool set(double x_m, double y_m, double theta_rad, std::optional<Time> known_at,
           std::string_view told_by = kConfiguration);

  /// The configuration has this fixed pose no more: if it is ours still, none is.
  void forget(const FixedPose& pose);

  /// The pose if it is known and not older than pose_max_age_ms.
  std::optional<OwnPose> valid(Time now) const;

  /// Age of the last pose, also of one that is too old. None: there never was one.
  std::optional<std::uint32_t> age_ms(Time now) const;

  /// Who told the last pose. Of use where age_ms() is.
  const std::string& told_by() const { return told_by_; }

  /// Older than that it is not valid; 0: no limit.
  std::uint32_t max_age_ms() const { return max_age_ms_; }

  /// As the air frame carries it. None: there never was one.
  std::optional<frame::FramePose> on_air(Time now) const;

  /// Whether a transmitter's pose is young enough to measure with.
  bool is_usable(const frame::FramePose& pose) const;

 private:
  void tell_whole_turns(double theta_rad);

  std::optional<FixedPose> pose_;
  std::optional<Time> set_at_;  // none: fixed
  std::uint32_t max_age_ms_;    // 0: no limit
  std::string told_by_{kConfiguration};
  bool has_told_whole_turns_ = false;
};

}  // namespace swarmtalk::daemon
