// Small compile-time helpers that stand in for <type_traits>, which avr-g++ does not have.
// Used by every header of core; holds no state.
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/// For a function in an inner loop that -Os would call rather than inline.
#define SWARMTALK_INLINE inline __attribute__((always_inline))
/// For a function on the way of every packet: inlined where speed counts more than size.
/// SWARMTALK_APART: for one that -Os would inline into its only caller, where a large function has
/// too few registers. SWARMTALK_SHARED: for a small one with many callers. Both are what measured
/// smallest on AVR, and nothing elsewhere.
/// SWARMTALK_ASIDE: for one that is not on the usual packet's way: kept out of its caller's
/// registers. SWARMTALK_AT_END: for the last call of a function, which the compiler jumps to.
#ifdef __AVR__
#define SWARMTALK_HOT
#define SWARMTALK_APART __attribute__((noinline))
#define SWARMTALK_HOT_APART __attribute__((noinline))
#define SWARMTALK_SHARED __attribute__((noinline))
#define SWARMTALK_ASIDE
#define SWARMTALK_AT_END __attribute__((noinline))
#define SWARMTALK_AVR_INLINE inline __attribute__((always_inline))
#else
#define SWARMTALK_HOT inline __attribute__((always_inline))
#define SWARMTALK_APART
#define SWARMTALK_HOT_APART SWARMTALK_HOT
#define SWARMTALK_SHARED
#define SWARMTALK_ASIDE __attribute__((noinline))
#define SWARMTALK_AT_END __attribute__((noinline))
#define SWARMTALK_AVR_INLINE
#endif
/// The parts of a node begin with start(), called by their constructors; on AVR by the node's own,
/// in memory that it has set to zero all at once. There cleared() costs nothing: a third of the
/// code.
#ifdef __AVR__
#define SWARMTALK_PART(Name) \
  Name() {}
#else
#define SWARMTALK_PART(Name) \
  Name() {                   \
    start();                 \
  }
#endif
/// A condition that is seldom true.
#define SWARMTALK_SELDOM(condition) __builtin_expect((condition) ? 1 : 0, 0)

namespace swarmtalk {
namespace core {

/// `pointer` (not null), kept in a register: avr-g++ would work out the address of a table's
/// element anew, with a multiplication, at each use.
template <class T>
SWARMTALK_INLINE T* in_register(T* pointer) {
#ifdef __AVR__
  __asm__("" : "+r"(pointer));
  if (pointer == nullptr) __builtin_unreachable();
#endif
  return pointer;
}

/// `pointer`, which the compiler would work out anew at each use, to have more registers for other
/// things: where there are enough of them.
template <class T>
SWARMTALK_INLINE T* computed_once(T* pointer) {
#ifndef __AVR__
  __asm__("" : "+r"(pointer));
#endif
  return pointer;
}

/// As in_register(), a number.
template <class Number>
SWARMTALK_INLINE Number in_register(Number number) {
#ifdef __AVR__
  __asm__("" : "+r"(number));
#endif
  return number;
}

/// A member that start() sets to zero, and on AVR is zero already: see SWARMTALK_PART.
template <class T>
SWARMTALK_INLINE void set_zero(T& member) {
#ifndef __AVR__
  memset(static_cast<void*>(&member), 0, sizeof(member));
#else
  (void)member;
#endif
}

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

#ifdef __AVR__
/// AVR shifts one bit at a time: one loop for all.
template <class Word>
inline Word shifted_bit(uint8_t place) {
  Word bit = 1;
  for (; place != 0; --place) bit = static_cast<Word>(bit << 1);
  return bit;
}
#endif
/// A word with only bit `place` set.
template <class Word>
SWARMTALK_INLINE Word one_bit(uint8_t place) {
#ifdef __AVR__
  if (!__builtin_constant_p(place)) return shifted_bit<Word>(place);
#endif
  return static_cast<Word>(Word{1} << place);
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
