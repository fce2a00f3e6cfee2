// Pacer: says when the next frame may leave. A token bucket (rate and burst) plus a random delay
// that keeps robots which were triggered by the same frame from answering in the same instant.
// Used by the links, on their thread. Reads no clock: the caller passes the time.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <random>

namespace swarmtalk::drivers {

/// Source: docs/decisions/0058-what-is-sent-on-waits.md.
inline constexpr std::chrono::microseconds kForwardJitterOfRadio{5000};

struct PacerConfig {
  double rate_limit_hz = 0.0;               // frames per second; 0: unlimited (a wire)
  std::uint32_t burst_frames = 1;           // frames that may leave at once after a pause, >= 1
  std::chrono::microseconds max_jitter{0};  // each frame waits a random 0..max_jitter more
  // One with nothing but packets of others waits a random 0..the larger of the two: their robots
  // have heard one frame, and would all send it on in the same instant.
  // None: as the link's interface needs it, which the link finds out when it is up.
  std::optional<std::chrono::microseconds> max_forward_jitter;
};

class Pacer {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// @param seed  of the jitter; a robot's own, or robots draw the same delays
  /// @throws std::runtime_error  rate below 0 or above 1e9, burst 0, jitter below 0 or above 10 s
  Pacer(const PacerConfig& config, std::uint64_t seed);

  /// How long a frame that waits at `now` must go on waiting; 0: it may leave. The delay is drawn
  /// at the first call after sent(): call only when something waits. Where a frame of others'
  /// packets waits already and something of our own comes, it is drawn anew.
  /// @param is_forward  all that waits is of others
  Duration wait(Time now, bool is_forward = false);

  /// For how long from `now` a frame that left would be faster than the rate; 0: it would not.
  Duration ahead(Time now) const {
    return full_at_ ? std::max(Duration(0), *full_at_ - burst_allowance_ - now) : Duration(0);
  }

  /// Whether it makes a difference to wait() whose packets wait.
  bool tells_forwards() const { return max_forward_jitter_ > max_jitter_; }
  /// What the interface needs, where the configuration leaves that open. It may come long after
  /// the daemon, and be another one than before.
  void suit(bool is_radio) {
    if (is_suiting_) max_forward_jitter_ = is_radio ? kForwardJitterOfRadio : Duration(0);
  }
  Duration longest_forward_jitter() const { return std::max(max_jitter_, max_forward_jitter_); }

  /// A frame left at `now`.
  void sent(Time now);

 private:
  Duration interval_{0};         // 1 / rate; 0: unlimited
  Duration burst_allowance_{0};  // (burst - 1) intervals
  Duration max_jitter_;
  Duration max_forward_jitter_;
  std::optional<Time> full_at_;  // when the bucket is full again; none: it is
  std::optional<Time> slot_;     // earliest time of the waiting frame, jitter included
  bool is_suiting_;
  bool is_slot_of_forward_ = false;
  std::mt19937_64 random_;
};

}  // namespace swarmtalk::drivers
