// Which calls of a DuplicateCache look at records for their age, and since when. A base of the
// cache: without buckets it takes no memory.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace core {

/// Which calls look at records for their age: every one, or every 32nd at 32 times as many.
template <bool kInTurns>
class SweepTurn {
 protected:
  static constexpr uint8_t kTurn = 32;
  bool is_turn() { return --left_ == 0; }
  void next_turn_in(uint8_t calls) { left_ = calls; }
  /// Ticks since the call before.
  uint32_t since_last(uint32_t now) {
    const uint32_t passed = now - last_;
    last_ = now;
    return passed;
  }

 private:
  uint8_t left_ = kTurn;
  uint32_t last_ = 0;
};
template <>
class SweepTurn<false> {
 protected:
  static constexpr uint8_t kTurn = 1;
  bool is_turn() { return true; }
  void next_turn_in(uint8_t) {}
  uint32_t since_last(uint32_t) { return 0; }
};

}  // namespace core
}  // namespace swarmtalk
