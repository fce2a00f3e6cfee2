// RangeOnce: the range of a frame's transmitter, worked out once for all packets of the frame. Used
// by NodeStation.
#pragma once

#include <optional>

#include "daemon/pose/ranging.hpp"
#include "drivers/link/link.hpp"

namespace swarmtalk::daemon {

class RangeOnce {
 public:
  /// @param measure  Range(const drivers::FrameReception&), called for the first packet of a frame
  template <typename Measure>
  const Range& of(const drivers::FrameReception& frame, const Measure& measure) {
    const bool is_known = is_known_ && frame.received_at == at_ && frame.pose == pose_;
    if (is_known) return range_;
    range_ = measure(frame);
    is_known_ = frame.pose && !frame.distance_m;  // else there is nothing to save
    pose_ = frame.pose;
    at_ = frame.received_at;
    return range_;
  }

  /// The frame has ended: its range must not be taken for that of another one.
  void end() { is_known_ = false; }

  /// Of the frame in hand, after of().
  const Range& last() const { return range_; }

 private:
  Range range_ = Range::unknown();
  bool is_known_ = false;
  std::optional<frame::FramePose> pose_;
  drivers::MonotonicTime at_{};
};

}  // namespace swarmtalk::daemon
