// Small compile-time helpers that stand in for <type_traits>, which avr-g++ does not have.
// Used by every header of core; holds no state.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "swarmtalk/avr.hpp"

namespace swarmtalk {
namespace core {

/// `Then` if kCondition, else `Else`.
template <bool kCondition, class Then, class Else>
struct Conditional {
  using Type = Then;
};
template <class Then, class Else>
struct Conditional<false, Then, Else> {
  using Type = Else;
};

/// The narrowest unsigned integer that holds kBits bits (0 to 64; 0 gives uint8_t).
template <uint16_t kBits>
using UintFor =
    typename Conditional<(kBits <= 8), uint8_t,
                         typename Conditional<(kBits <= 16), uint16_t,
                                              typename Conditional<(kBits <= 32), uint32_t,
                                                                   uint64_t>::Type>::Type>::Type;

/// Bits needed to write every number from 0 to `largest`.
constexpr uint8_t bits_for(uint32_t largest) {
  uint8_t bits = 0;
  for (; largest != 0; largest >>= 1) ++bits;
  return bits;
}

/// All ones in the low `bits` bits (0 to 32).
constexpr uint32_t low_bits(uint8_t bits) {
  return bits >= 32 ? UINT32_C(0xFFFFFFFF) : (UINT32_C(1) << bits) - 1;
}

/// What a call came to. Expected failures only; the caller has to look.
enum class Error : uint8_t {
  kOk = 0,
  kBusy,             // the previous message on this channel has not left yet: try after `sent`
  kTooLong,          // message longer than the channel can carry
  kEmpty,            // the wire format cannot carry a message of 0 bytes
  kTtlTooLarge,      // TTL does not fit its field
  kNoRoom,           // every channel, publisher or subscriber slot is taken
  kBadChannel,       // channel number does not fit its field
  kAlreadyOpen,      // this node has the channel already
  kWrongTimestamps,  // the channel's number fixes whether it is timestamped, and not like this
  kBadPacket,        // packet too short, too long or contradicting itself
  kBadChecksum,      // packet damaged
};

}  // namespace core
}  // namespace swarmtalk
