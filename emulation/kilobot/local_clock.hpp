// LocalClock: the processor clock of one emulated node. Converts between the time that all nodes
// share (ns since the emulation began) and the node's own cycle count, which starts at its power-on
// and runs fast or slow by its drift. Integer arithmetic, so every machine gets the same cycles.
#pragma once

#include <cmath>
#include <cstdint>

namespace swarmtalk::emulator {

__extension__ typedef unsigned __int128 Uint128;

class LocalClock {
 public:
  /// @param power_on_ns  shared time of cycle 0
  /// @param clock_hz     nominal frequency, 1..1e9
  /// @param drift_ppm    how much faster than nominal, -500'000..500'000
  LocalClock(std::uint64_t power_on_ns, std::uint32_t clock_hz, double drift_ppm)
      : power_on_ns_(power_on_ns),
        rate_(static_cast<std::uint64_t>(
            std::ceil(clock_hz * (1.0 + drift_ppm * 1e-6) * 1e-9 * 0x1p48))) {}

  /// Whole cycles that have passed at a shared time; 0 before power-on.
  std::uint64_t cycle_at(std::uint64_t time_ns) const {
    if (time_ns <= power_on_ns_) return 0;
    return static_cast<std::uint64_t>((Uint128{time_ns - power_on_ns_} * rate_) >> 48);
  }

  /// The first shared time at which the node has reached a cycle.
  std::uint64_t time_of_ns(std::uint64_t cycle) const {
    return power_on_ns_ + static_cast<std::uint64_t>(((Uint128{cycle} << 48) + rate_ - 1) / rate_);
  }

  std::uint64_t power_on_ns() const { return power_on_ns_; }

 private:
  std::uint64_t power_on_ns_;
  std::uint64_t rate_;  // cycles per ns, times 2^48
};

}  // namespace swarmtalk::emulator
