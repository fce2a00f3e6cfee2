// LogLimiter: lets one cause speak at most once per second, and tells how often it kept silent.
// For what strangers can cause: bad frames, garbage on the socket, refused clients.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

namespace swarmtalk::daemon {

class LogLimiter {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// One more event. @return none: stay silent; else how many were silent since the last time
  std::optional<std::uint64_t> pass(Time now) {
    if (last_ && now - *last_ < std::chrono::seconds(1)) {
      ++silent_;
      return std::nullopt;
    }
    last_ = now;
    const std::uint64_t silent = silent_;
    silent_ = 0;
    return silent;
  }

 private:
  std::optional<Time> last_;
  std::uint64_t silent_ = 0;
};

}  // namespace swarmtalk::daemon
