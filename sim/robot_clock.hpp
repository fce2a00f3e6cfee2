// RobotClock: the clock of a simulated robot, which drifts against true time, begins when the robot
// is switched on and may be made to jump. A value.
#pragma once

#include <cstdint>

#include "sim/world_config.hpp"

namespace swarmtalk::sim {

class RobotClock {
 public:
  RobotClock() = default;
  RobotClock(int32_t drift_ppm, uint64_t power_on_us)
      : power_on_us_(power_on_us), drift_ppm_(drift_ppm) {}

  uint64_t power_on_us() const { return power_on_us_; }

  /// What it shows at a true time.
  uint32_t ticks(uint64_t now_us) const {
    const int64_t on_us = static_cast<int64_t>(now_us - power_on_us_);
    const int64_t local_us = on_us + on_us * drift_ppm_ / 1000000;
    return static_cast<uint32_t>(local_us / kTickUs + step_ticks_);
  }

  /// How long so much of its time takes.
  uint64_t true_us(uint64_t us) const {
    return us - static_cast<uint64_t>(static_cast<int64_t>(us) * drift_ppm_ / 1000000);
  }

  void jump(int32_t ticks) { step_ticks_ += ticks; }
  void restart(uint64_t now_us) {
    power_on_us_ = now_us;
    step_ticks_ = 0;
  }

 private:
  uint64_t power_on_us_ = 0;
  int64_t step_ticks_ = 0;
  int32_t drift_ppm_ = 0;
};

}  // namespace swarmtalk::sim
