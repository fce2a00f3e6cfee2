// Hearing: which robots' packets a station takes, of those that its link hears. Owned by the
// station, on the daemon's thread.
#pragma once

#include <cmath>
#include <cstdint>

#include "daemon/config/config.hpp"
#include "daemon/pose/ranging.hpp"
#include "drivers/link/link.hpp"

namespace swarmtalk::daemon {

class Hearing {
 public:
  void set_virtual_range(const VirtualRange& range) { range_ = range; }
  void set_ghosts(bool are_heard) { hears_ghosts_ = are_heard; }

  /// Whether a packet in this frame is taken; counts it under its cause if not.
  bool takes(const drivers::FrameReception& frame, const Range& range) {
    if (frame.is_ghost && !hears_ghosts_) {
      ++packets_of_ghosts_;
      return false;
    }
    if (!is_out_of_range(range)) return true;
    ++(std::isnan(range.distance_m) ? packets_unknown_distance_ : packets_too_far_);
    return false;
  }

  /// The same of what is no packet; counts nothing.
  bool takes_beacon(const drivers::FrameReception& frame, const Range& range) const {
    return (!frame.is_ghost || hears_ghosts_) && !is_out_of_range(range);
  }

  bool is_out_of_range(const Range& range) const {
    if (range_.limit_m == 0.0) return false;
    if (std::isnan(range.distance_m)) return range_.drops_unknown;
    return static_cast<double>(range.distance_m) > range_.limit_m + kPoseStepM;
  }

  void add_counters(drivers::Counters& to) const {
    to.insert(to.end(), {{"packets_too_far", packets_too_far_},
                         {"packets_unknown_distance", packets_unknown_distance_},
                         {"packets_of_ghosts", packets_of_ghosts_}});
  }

 private:
  VirtualRange range_;
  bool hears_ghosts_ = true;
  std::uint64_t packets_too_far_ = 0;
  std::uint64_t packets_unknown_distance_ = 0;
  std::uint64_t packets_of_ghosts_ = 0;
};

}  // namespace swarmtalk::daemon
