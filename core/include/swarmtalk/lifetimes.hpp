// For how long a node remembers a message, from a profile's ticks. Used by DuplicateCache.
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
struct Wandering : Lifetimes<P> {
  using Ticks = typename Lifetimes<P>::Ticks;
  static Ticks ticks(uint16_t packets) {
    using L = Lifetimes<P>;
    return L::kWanderEnds && packets > (L::kFloodLife - L::kSurely) / L::kWander
               ? L::kFloodLife
               : static_cast<Ticks>(L::kSurely + packets * L::kWander);
  }
};
/// The same, worked out when it is told how many wait, for who asks often.
template <class P, bool kAtOnce>
class WanderTime {
 public:
  using Ticks = typename Lifetimes<P>::Ticks;
  void start() { ticks_ = Lifetimes<P>::kSurely; }
  void set_waiting(uint16_t packets) { ticks_ = Wandering<P>::ticks(packets); }
  Ticks ticks() const { return ticks_; }

 private:
  Ticks ticks_;
};
/// Or when it is asked, for who is told often.
template <class P>
class WanderTime<P, false> {
 public:
  using Ticks = typename Lifetimes<P>::Ticks;
  using Packets = UintFor<bits_for(P::kForwardSlots)>;
  void start() { packets_ = 0; }
  void set_waiting(uint16_t packets) { packets_ = static_cast<Packets>(packets); }
  Ticks ticks() const { return Wandering<P>::ticks(packets_); }

 private:
  Packets packets_;
};

}  // namespace core
}  // namespace swarmtalk
