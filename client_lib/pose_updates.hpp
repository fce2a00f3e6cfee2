// PoseUpdates: tells the daemon where the robot is, one pose at a time: while an answer is awaited
// the newest waits, and replaces the one that waited. On the owner's thread.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "client_lib/deliveries.hpp"
#include "client_lib/requests.hpp"
#include "client_lib/state.hpp"

namespace swarmtalk::client {

class PoseUpdates {
 public:
  /// All must outlive it. @param on_waiting  a request waits to be written
  /// @param hint  is given the sentence for a heading that looks like degrees, once
  PoseUpdates(Requests& requests, Deliveries& deliveries, std::function<void()> on_waiting,
              std::function<void(const std::string&)> hint)
      : requests_(requests),
        deliveries_(deliveries),
        on_waiting_(std::move(on_waiting)),
        hint_(std::move(hint)) {}

  /// @pre connected. @return kBadPose, which is reported too
  Status set(const OwnPose& pose);
  /// Whether a pose waits for the answer to the one before.
  bool is_waiting() const { return next_.has_value(); }
  /// The connection is lost, and with it what waited.
  void forget();

 private:
  void send(const OwnPose& pose);
  void check_heading(float theta_rad);

  Requests& requests_;
  Deliveries& deliveries_;
  std::function<void()> on_waiting_;
  std::function<void(const std::string&)> hint_;
  bool has_hinted_ = false;
  bool is_in_flight_ = false;
  std::optional<OwnPose> next_;
};

}  // namespace swarmtalk::client
