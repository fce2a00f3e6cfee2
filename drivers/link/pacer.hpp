// Pacer: says when the next frame may leave. A token bucket (rate and burst) plus a random delay
// that keeps robots which were triggered by the same frame from answering in the same instant.
// Used by the links, on their thread. Reads no clock: the caller passes the time.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <random>

namespace swarmtalk::drivers {

struct PacerConfig {
  double rate_limit_hz = 0.0;               // frames per second; 0: unlimited (a wire)
  std::uint32_t burst_frames = 1;           // frames that may leave at once after a pause, >= 1
  std::chrono::microseconds max_jitter{0};  // each frame waits a random 0..max_jitter more
};

class Pacer {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// @param seed  of the jitter; a robot's own, or robots draw the same delays
  /// @throws std::runtime_error  rate below 0 or above 1e9, burst 0, jitter below 0 or above 10 s
  Pacer(const PacerConfig& config, std::uint64_t seed);

  /// How long a frame that waits at `now` must go on waiting; 0: it may leave. The delay is drawn
  /// at the first call after sent(): call only when something waits.
  Duration wait(Time now);

  /// A frame left at `now`.
  void sent(Time now);

 private:
  Duration interval_{0};         // 1 / rate; 0: unlimited
  Duration burst_allowance_{0};  // (burst - 1) intervals
  Duration max_jitter_;
  std::optional<Time> full_at_;  // when the bucket is full again; none: it is
  std::optional<Time> slot_;     // earliest time of the waiting frame, jitter included
  std::mt19937_64 random_;
};

}  // namespace swarmtalk::drivers
