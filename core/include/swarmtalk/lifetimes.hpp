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

  // With a clock of 16 bits lives are rounded up to a multiple of 8 ticks.
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
  /// Whether a full queue is more than kFloodLife, so that a limit is needed.
  static constexpr bool kWanderEnds = (kFloodLife - kSurely) / kWander < P::kForwardSlots;
  static constexpr uint32_t kLongestLife =
      P::kFloodTicks > P::kAssemblyTicks ? P::kFloodTicks : P::kAssemblyTicks;

  /// For how long copies of a flooded message wander, as far as one can tell: the longer, the more
  /// packets wait to be sent on here, since about as many wait at our neighbours.
  static Ticks wander(uint16_t packets) {
    return kWanderEnds && packets > (kFloodLife - kSurely) / kWander
               ? kFloodLife
               : static_cast<Ticks>(kSurely + packets * kWander);
  }
};

}  // namespace core
}  // namespace swarmtalk
