// PoseUpdates: tells the daemon where the robot is, at once; while too many answers are awaited the
// newest waits, and replaces the one that waited. On the owner's thread.
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
  struct Hooks {
    std::function<void()> on_waiting;              // a request waits to be written
    std::function<void()> look_for_answers;        // without waiting for them
    std::function<void(const std::string&)> hint;  // that a heading looks like degrees, once
  };
  /// All must outlive it.
  PoseUpdates(Requests& requests, Deliveries& deliveries, Hooks hooks)
      : requests_(requests), deliveries_(deliveries), hooks_(std::move(hooks)) {}

  /// @pre connected. @return kBadPose, which is reported too
  Status set(const OwnPose& pose);
  /// Whether a pose waits for the answers to those before.
  bool is_waiting() const { return next_.has_value(); }
  /// Whether any has not been answered.
  bool is_unanswered() const { return in_flight_ > 0; }
  /// What waits goes out as it is: the program ends.
  void send_rest();
  /// The connection is lost, and with it what waited.
  void forget();

 private:
  void send(const OwnPose& pose);
  void check_heading(float theta_rad);

  Requests& requests_;
  Deliveries& deliveries_;
  Hooks hooks_;
  bool has_hinted_ = false;
  int in_flight_ = 0;
  std::optional<OwnPose> next_;
};

}  // namespace swarmtalk::client
