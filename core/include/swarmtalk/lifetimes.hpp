// For how long a node remembers a message, from a profile's ticks. Used by Record and
// DuplicateCache.
#pragma once

#include <stdint.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

template <class P>
struct Lifetimes {
  using Ticks = UintFor<P::kClockBits>;

  // With a clock of 16 bits lives are rounded up to 8 ticks.
  static constexpr uint8_t kStepTicks = P::kClockBits == 16 ? 8 : 1;
  static constexpr Ticks whole_steps(uint32_t ticks) {
    return static_cast<Ticks>((ticks + kStepTicks - 1) / kStepTicks * kStepTicks);
  }
  static constexpr Ticks kOneHopLife = whole_steps(P::kOneHopDuplicateTicks);
  static constexpr Ticks kAssemblyLife = whole_steps(P::kAssemblyTicks);
  static constexpr Ticks kFloodLife = whole_steps(P::kFloodTicks);
  static constexpr Ticks kSurely = whole_steps(P::kFloodSurelyTicks);
  /// How much longer for each packet that waits.
  static constexpr Ticks kWander =
      static_cast<Ticks>(kSurely < 8u * kStepTicks ? 1 : kSurely / kStepTicks / 8u * kStepTicks);
  static constexpr bool kWanderEnds =
      (kFloodLife - kSurely) / kWander < P::kForwardSlots;  // else all that wait may count
  static constexpr uint32_t kLongestLife =
      P::kFloodTicks > P::kAssemblyTicks ? P::kFloodTicks : P::kAssemblyTicks;
};

/// For how long copies of a flooded message wander, as far as one can tell: the longer, the more
/// packets wait to be sent on here, since about as many wait at our neighbours.
template <class P>
class WanderTime : Lifetimes<P> {
  using L = Lifetimes<P>;

 public:
  using typename L::Ticks;
  void start() { ticks_ = L::kSurely; }
  void set_waiting(uint16_t packets) {
    const bool is_all = L::kWanderEnds && packets > (L::kFloodLife - L::kSurely) / L::kWander;
    ticks_ = is_all ? L::kFloodLife : static_cast<Ticks>(L::kSurely + packets * L::kWander);
  }
  Ticks ticks() const { return ticks_; }

 private:
  Ticks ticks_;
};

}  // namespace core
}  // namespace swarmtalk
