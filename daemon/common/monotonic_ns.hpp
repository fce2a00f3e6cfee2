// The one clock of what is passed between programs of a machine.
#pragma once

#include <chrono>
#include <cstdint>

namespace swarmtalk::daemon {

/// CLOCK_MONOTONIC now, in nanoseconds.
inline std::uint64_t monotonic_ns() {
  const auto now = std::chrono::steady_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
}

}  // namespace swarmtalk::daemon
