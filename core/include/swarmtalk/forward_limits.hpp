// How far and for how long a node sends on packets of others, where a profile says that it can be
// limited (kLimitsForwarding). A message then travels for at most max_ttl * (max_wait + air time),
// however many robots there are and whatever its packets say. A base of the node: there, it takes
// no memory where nothing is limited.
#pragma once

#include <stdint.h>

#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

template <class P, bool kPresent = P::kLimitsForwarding>
class ForwardLimits {
 public:
  using Ticks = UintFor<P::kClockBits>;

  /// Packets that were not sent on because they had waited for too long. (Not one of Counters: most
  /// nodes have no room for what they never count.)
  typename P::Counter forwards_too_late() const { return too_late_; }

 protected:
  SWARMTALK_PART(ForwardLimits)
  void start() {
    max_ttl_ = 255;
    set_zero(max_wait_);
    set_zero(too_late_);
  }
  /// @param max_ttl   a packet that allows more hops is sent on as if it allowed so many; 0: no
  ///                  packet is sent on
  /// @param max_wait  ticks; what has waited for longer is not sent on; 0: no limit
  void set_limits(uint8_t max_ttl, Ticks max_wait) {
    max_ttl_ = max_ttl;
    max_wait_ = max_wait;
  }
  bool is_sent_on(uint8_t ttl) const { return ttl != 0 && max_ttl_ != 0; }
  uint8_t allowed_ttl(uint8_t ttl) const { return ttl < max_ttl_ ? ttl : max_ttl_; }
  Ticks max_wait() const { return max_wait_; }
  void count_too_late(typename P::Counter packets) {
    too_late_ = static_cast<typename P::Counter>(too_late_ + packets);
  }

 private:
  uint8_t max_ttl_;
  Ticks max_wait_;
  typename P::Counter too_late_;
};

/// No code and no memory.
template <class P>
class ForwardLimits<P, false> {
 protected:
  using Ticks = UintFor<P::kClockBits>;
  static void start() {}
  static bool is_sent_on(uint8_t ttl) { return ttl != 0; }
  static uint8_t allowed_ttl(uint8_t ttl) { return ttl; }
  static constexpr Ticks max_wait() { return 0; }
  static void count_too_late(typename P::Counter) {}
};

}  // namespace core
}  // namespace swarmtalk
