// LogLimiter: lets one cause speak at most once per second, after a pause some times at once if so
// made, and tells how often it kept silent.
// For what strangers can cause: bad frames, garbage on the socket, refused clients.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "daemon/common/token_bucket.hpp"

namespace swarmtalk::daemon {

class LogLimiter {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// @param burst  lines at once after a pause, at least 1
  explicit LogLimiter(std::uint32_t burst = 1) : turns_(1, burst) {}

  /// One more event. @return none: stay silent; else how many were silent since the last time
  std::optional<std::uint64_t> pass(Time now) {
    const auto since = std::chrono::nanoseconds(now.time_since_epoch()).count();
    if (!turns_.take(static_cast<std::uint64_t>(since))) {
      ++silent_;
      return std::nullopt;
    }
    const std::uint64_t silent = silent_;
    silent_ = 0;
    return silent;
  }

 private:
  TokenBucket turns_;
  std::uint64_t silent_ = 0;
};

}  // namespace swarmtalk::daemon
