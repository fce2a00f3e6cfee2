// StationClock: the time as a station's node sees it. While a packet is being received it is the
// time when the kernel took it: what it waited for us then counts in its delay. It never goes back,
// as a node's clock must not.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/link/link.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {

class StationClock {
 public:
  using Time = drivers::MonotonicTime;

  /// Stands still at this time until release(): when a packet was received, or is being pulled.
  void hold(Time time) { held_ = time; }
  void release() { held_.reset(); }

  std::chrono::microseconds now() {
    latest_ = std::max(latest_, held_ ? *held_ : loop::now());
    return std::chrono::duration_cast<std::chrono::microseconds>(latest_.time_since_epoch());
  }

 private:
  std::optional<Time> held_;
  Time latest_{};  // that the node was told
};

}  // namespace swarmtalk::daemon
