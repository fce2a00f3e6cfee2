// Beacon: says when a link that has been silent tells its neighbours that the robot is there. Only
// silence is broken: a robot that transmits tells enough. Used by the links, on their thread. Reads
// no clock: the caller passes the time.
#pragma once

#include <chrono>
#include <cstdint>
#include <random>

namespace swarmtalk::drivers {

class Beacon {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// @param interval  longest silence; 0: no beacons. Each lasts a random quarter less, so that
  ///   robots that start together do not speak together
  /// @param seed  a robot's own
  Beacon(std::chrono::milliseconds interval, std::uint64_t seed);

  bool is_on() const { return interval_ > Duration(0); }

  /// A frame left, or silence begins to count.
  void silence_begins(Time now) { due_ = now + draw(); }

  /// How long the silence may last yet; 0: it is time. @pre is_on(), and silence has begun
  Duration wait(Time now) const { return due_ > now ? due_ - now : Duration(0); }

 private:
  Duration draw();

  Duration interval_;
  Time due_{};
  std::minstd_rand random_;
};

}  // namespace swarmtalk::drivers
