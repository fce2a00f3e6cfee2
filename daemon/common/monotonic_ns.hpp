// The one clock of what is passed between programs of a machine.
#pragma once

#include <chrono>
#include <cstdint>

#include "loop/clock.hpp"

namespace swarmtalk::daemon {

/// CLOCK_MONOTONIC now, in nanoseconds.
inline std::uint64_t monotonic_ns() {
  const auto now = loop::now().time_since_epoch();
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
}

}  // namespace swarmtalk::daemon
