// Random: the only source of chance in the emulator. Each user has a stream of its own, derived
// from the scenario's seed and a stream number, so that adding one node or one draw somewhere does
// not change what the others see. Generator: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014).
#pragma once

#include <cstdint>

namespace swarmtalk::emulator {

class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream) : state_(mix(seed) ^ mix(~stream)) {}

  std::uint64_t next() {
    state_ += 0x9E3779B97F4A7C15u;
    return mix(state_);
  }

  /// Uniform in 0..limit-1; limit >= 1.
  std::uint32_t below(std::uint32_t limit) {
    return static_cast<std::uint32_t>(((next() >> 32) * limit) >> 32);
  }

  /// Uniform in [0, 1).
  double unit() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }

  /// True with the given probability, 0..1. Draws nothing for 0, so that a scenario without loss
  /// costs nothing.
  bool happens(double probability) { return probability > 0 && unit() < probability; }

  /// Nearly normal, mean 0, standard deviation 1: the sum of twelve uniform draws, which needs no
  /// library function and is therefore the same everywhere.
  double normal() {
    double sum = -6;
    for (int draw = 0; draw < 12; ++draw) sum += unit();
    return sum;
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }

  std::uint64_t state_;
};

}  // namespace swarmtalk::emulator
