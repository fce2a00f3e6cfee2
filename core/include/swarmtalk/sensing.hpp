// What a robot measured while a packet arrived, and what a receive callback is told.
// Sensing always refers to the last transmitter of the last packet, for a forwarded message its
// forwarder; `hops` tells which it was.
#pragma once

#include <stdint.h>

#include "swarmtalk/profile.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// Hops travelled cannot be known (the wire does not carry them and the TTLs do not tell).
constexpr uint8_t kHopsUnknown = 255;

/// Distance in whole units of the platform (Kilobot: mm). Negative is unknown.
struct DistanceSensing {
  using Distance = int16_t;
  Distance distance;

  /// Whether a subscriber that wants nothing from `limit` or farther (0 or more) takes this;
  /// unknown passes.
  bool is_within(Distance limit) const { return distance < limit; }
};

/// Distance and bearing of a platform with floats; NaN is unknown, and passes every limit.
struct PoseSensing {
  using Distance = float;
  float distance_m;
  float bearing_rad;
  uint32_t link_token;  // the link's own mark of the frame this came in; core only hands it on

  bool is_within(Distance limit) const { return !(distance_m >= limit); }
};

/// What comes with a message, beside its bytes: the header of its last packet, of which `hops` is
/// kHopsUnknown if neither the wire nor the TTLs tell, and what was measured.
template <class P>
struct Reception : Wire<P>::Header {
  typename P::Sensing sensing;  // of the last packet's transmitter
  /// Ticks from send() to now, waits in all buffers on the way included, air time not. At
  /// Wire<P>::kTimestampMax it means "at least". 0 if !has_delay.
  typename Wire<P>::Timestamp delay_ticks;
};

}  // namespace core
}  // namespace swarmtalk
