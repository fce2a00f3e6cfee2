// Seconds of the command line as times to wait for. A time too long to be counted is for ever.
#pragma once

#include <chrono>

namespace swarmtalk::cli {

using Clock = std::chrono::steady_clock;

/// @param value  seconds, 0 or more
inline std::chrono::nanoseconds seconds(double value) {
  constexpr double kLongestS = 9e9;  // 285 years; int64 holds 9.2e9 s in nanoseconds
  if (!(value < kLongestS)) return std::chrono::nanoseconds::max();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(value));
}

/// `start` and `duration`, without overflow.
inline Clock::time_point after(Clock::time_point start, std::chrono::nanoseconds duration) {
  constexpr Clock::time_point kEnd = Clock::time_point::max();
  return duration > kEnd - start ? kEnd : start + duration;
}

}  // namespace swarmtalk::cli
