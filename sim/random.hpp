// Random numbers of the simulation: a generator and distributions of our own, so that one seed
// gives the same numbers with every compiler and library. Each robot and the medium own one each.
#pragma once

#include <cstdint>

namespace swarmtalk::sim {

/// Spreads the bits of `value`. Source: Steele, Lea, Flood, OOPSLA 2014 (SplitMix64).
constexpr uint64_t mix(uint64_t value) {
  value = (value ^ (value >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
  value = (value ^ (value >> 27)) * UINT64_C(0x94D049BB133111EB);
  return value ^ (value >> 31);
}

class Random {
 public:
  explicit Random(uint64_t seed = 0) : state_(mix(seed + kStep)) {}

  uint64_t bits() { return mix(state_ += kStep); }

  /// Uniform in [0, limit); limit >= 1.
  uint32_t below(uint32_t limit) {
    return static_cast<uint32_t>(((bits() >> 32) * uint64_t{limit}) >> 32);
  }

  /// Uniform in [0, 1).
  double uniform() { return unit(bits()); }

  /// Uniform in [-1, 1).
  double symmetric() { return 2 * uniform() - 1; }

  /// Mean 0, standard deviation 1, nearly normal: the sum of four uniforms, so never beyond 3.47.
  double normal() {
    const uint64_t draw = bits();
    const uint64_t sum = (draw & 0xFFFF) + ((draw >> 16) & 0xFFFF) + ((draw >> 32) & 0xFFFF) +
                         ((draw >> 48) & 0xFFFF);
    constexpr double kRootOf3 = 1.7320508075688772;
    return (static_cast<double>(sum) / 65536.0 - 2 + 2.0 / 65536.0) * kRootOf3;
  }

  /// [0, 1) from 64 random bits.
  static double unit(uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

 private:
  static constexpr uint64_t kStep = UINT64_C(0x9E3779B97F4A7C15);
  uint64_t state_;
};

}  // namespace swarmtalk::sim
