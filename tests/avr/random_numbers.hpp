// Seeded random numbers that are the same with every compiler and library (splitmix64).
#pragma once

#include <cstddef>
#include <cstdint>

namespace swarmtalk::avr {

class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  uint64_t next() {
    uint64_t bits = state_ += UINT64_C(0x9E3779B97F4A7C15);
    bits = (bits ^ bits >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    bits = (bits ^ bits >> 27) * UINT64_C(0x94D049BB133111EB);
    return bits ^ bits >> 31;
  }
  /// 0..count-1
  uint32_t below(std::size_t count) { return static_cast<uint32_t>((next() >> 32) * count >> 32); }
  /// 0..count-1, low ones more often.
  uint32_t low_below(std::size_t count) { return below(below(count) + 1u); }
  uint8_t between(unsigned from, unsigned to) {
    return static_cast<uint8_t>(from + below(to - from + 1u));
  }
  bool chance(unsigned percent) { return below(100) < percent; }

 private:
  uint64_t state_;
};

}  // namespace swarmtalk::avr
