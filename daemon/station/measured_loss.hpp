// MeasuredLoss: what share of frames is lost around this robot, as its neighbours' counts of frames
// tell: how well they are heard here stands for how well they hear us. Owned by a station; reads no
// clock.
#pragma once

#include <span>

#include "daemon/station/neighbours.hpp"

namespace swarmtalk::daemon {

class MeasuredLoss {
 public:
  /// Of a neighbour of whom fewer frames are known nothing is said.
  static constexpr std::uint64_t kLeastFrames = 20;

  /// Three of four neighbours are heard with at most this loss, 0 to 1; 0: nobody is. Looked up
  /// once a second.
  double of(const Neighbours& neighbours, Neighbour::Time now);

  static double of(std::span<const Neighbour> neighbours);

 private:
  double loss_ = 0;
  Neighbour::Time looked_at_{};
};

}  // namespace swarmtalk::daemon
