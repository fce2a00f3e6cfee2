#include "client_lib/pose_updates.hpp"

#include <cmath>

namespace swarmtalk::client {
namespace {

constexpr float kPoseMaxM = 32.767f;  // int16 millimetres on the air

}  // namespace

Status PoseUpdates::set(const OwnPose& pose) {
  const bool is_good = std::isfinite(pose.theta_rad) && std::fabs(pose.x_m) <= kPoseMaxM &&
                       std::fabs(pose.y_m) <= kPoseMaxM;  // false for NaN
  if (!is_good) {
    const Status status(StatusCode::kBadPose);
    deliveries_.report(status);
    return status;
  }
  if (is_in_flight_) {
    next_ = pose;
  } else {
    send(pose);
    on_waiting_();
  }
  return Status();
}

void PoseUpdates::forget() {
  is_in_flight_ = false;
  next_.reset();
}

void PoseUpdates::send(const OwnPose& pose) {
  ipc::SetPose& body = *requests_.make().mutable_set_pose();
  body.set_x_m(pose.x_m);
  body.set_y_m(pose.y_m);
  body.set_theta_rad(pose.theta_rad);
  if (pose.is_fixed) body.set_fixed(true);
  is_in_flight_ = true;
  requests_.send([this](const ipc::Envelope*, const Status& status) {
    is_in_flight_ = false;
    if (status.code() == StatusCode::kDisconnected) return;
    if (!status) {
      requests_.note_refusal(status);
      deliveries_.report(status);
    }
    if (const auto next = std::exchange(next_, std::nullopt)) send(*next);
  });
}

}  // namespace swarmtalk::client
