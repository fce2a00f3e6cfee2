#include "client_lib/pose_updates.hpp"

#include <cmath>
#include <cstdio>
#include <numbers>

namespace swarmtalk::client {
namespace {

constexpr float kPoseMaxM = 32.767f;      // int16 millimetres on the air
constexpr int kMostInFlight = 64;         // their answers fit what a program may leave unread
constexpr float kWholeTurnRad = 6.2842f;  // and what rounding adds to one

}  // namespace

Status PoseUpdates::set(const OwnPose& pose) {
  const bool is_good = std::isfinite(pose.theta_rad) && std::fabs(pose.x_m) <= kPoseMaxM &&
                       std::fabs(pose.y_m) <= kPoseMaxM;  // false for NaN
  if (!is_good) {
    const Status status(StatusCode::kBadPose);
    deliveries_.report(status);
    return status;
  }
  check_heading(pose.theta_rad);
  if (in_flight_ >= kMostInFlight) hooks_.look_for_answers();
  if (in_flight_ >= kMostInFlight) {
    next_ = pose;
  } else {
    send(pose);
    hooks_.on_waiting();
  }
  return Status();
}

/// A heading that somebody adds up may be more than a turn as well, so it is taken.
void PoseUpdates::check_heading(float theta_rad) {
  if (!(std::fabs(theta_rad) > kWholeTurnRad) || std::exchange(has_hinted_, true)) return;
  char text[256];
  std::snprintf(text, sizeof text,
                "the heading of a pose is in radians; %g is more than a whole turn and looks like "
                "degrees, which are %g radians (this is said once; whole turns are left out)",
                static_cast<double>(theta_rad),
                static_cast<double>(theta_rad) * std::numbers::pi / 180);
  hooks_.hint(text);
}

void PoseUpdates::forget() {
  in_flight_ = 0;
  next_.reset();
}

void PoseUpdates::send_rest() {
  if (const auto next = std::exchange(next_, std::nullopt)) send(*next);
}

void PoseUpdates::send(const OwnPose& pose) {
  ipc::SetPose& body = *requests_.make().mutable_set_pose();
  body.set_x_m(pose.x_m);
  body.set_y_m(pose.y_m);
  body.set_theta_rad(pose.theta_rad);
  if (pose.is_fixed) body.set_fixed(true);
  ++in_flight_;
  requests_.send([this](const ipc::Envelope*, const Status& status) {
    if (in_flight_ > 0) --in_flight_;
    if (status.code() == StatusCode::kDisconnected) return;
    if (!status) {
      requests_.note_refusal(status);
      deliveries_.report_untold(status);
    }
    send_rest();
  });
}

}  // namespace swarmtalk::client
