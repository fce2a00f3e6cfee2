// Lamp: an infrared sender above the robots that plays messages at given times, for runs without an
// overhead controller's image.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "emulation/kilobot/medium.hpp"
#include "emulation/kilobot/scenario.hpp"
#include "emulation/kilobot/scheduler.hpp"

namespace swarmtalk::emulator {

class Lamp : public Steppable {
 public:
  Lamp(Medium& medium, const std::vector<LampSpec>& messages)
      : medium_(medium), station_(medium.add_station({0, 0, kReachMm}, nullptr)) {
    for (const LampSpec& spec : messages) {
      const std::vector<std::uint64_t> pulses = ir_pulses(spec.message);
      for (unsigned copy = 0; copy < spec.copies; ++copy) {
        const auto start_ns =
            static_cast<std::uint64_t>(std::llround(spec.at_s * 1e9 + copy * spec.period_ms * 1e6));
        for (const std::uint64_t pulse_ns : pulses) pulses_ns_.push_back(start_ns + pulse_ns);
      }
    }
    std::stable_sort(pulses_ns_.begin(), pulses_ns_.end());
  }

  void run_until(std::uint64_t time_ns) override {
    for (; next_ < pulses_ns_.size() && pulses_ns_[next_] < time_ns; ++next_) {
      medium_.switch_light(station_, pulses_ns_[next_], true);
      medium_.switch_light(station_, pulses_ns_[next_] + kIrPulseNs, false);
    }
  }

 private:
  static constexpr double kReachMm = 1e9;

  Medium& medium_;
  unsigned station_;
  std::vector<std::uint64_t> pulses_ns_;
  std::size_t next_ = 0;
};

}  // namespace swarmtalk::emulator
