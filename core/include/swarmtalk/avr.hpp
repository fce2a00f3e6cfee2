// What avr-g++ has to be told, and other compilers do not: which functions are called and which are
// inlined, what stays in a register, how memory is set to zero. Each use is what measured smallest
// or quickest there (tests/avr); elsewhere none of it does anything. Used by every header of core.
#pragma once

#include <stdint.h>
#include <string.h>

#ifdef __AVR__
/// A function that -Os would inline, where a large function has too few registers or where a small
/// one has many callers.
#define SWARMTALK_AVR_CALLED __attribute__((noinline))
/// A function in an inner loop that -Os would call.
#define SWARMTALK_AVR_INLINED inline __attribute__((always_inline))
/// The parts of a node begin with start(), called by their constructors; on AVR by the node's own,
/// in memory that it has set to zero all at once. set_zero() costs nothing there, which saves a
/// third of the code.
#define SWARMTALK_PART(Name) \
  Name() {}
#else
#define SWARMTALK_AVR_CALLED
#define SWARMTALK_AVR_INLINED
#define SWARMTALK_PART(Name) \
  Name() {                   \
    start();                 \
  }
#endif

namespace swarmtalk {
namespace core {

/// See SWARMTALK_PART.
#ifdef __AVR__
constexpr bool kNodeStartsParts = true;
#else
constexpr bool kNodeStartsParts = false;
#endif

/// `pointer` (not null), kept in a register: avr-g++ would work out the address of a table's
/// element again at each use, with a multiplication.
template <class T>
SWARMTALK_AVR_INLINED T* in_register(T* pointer) {
#ifdef __AVR__
  __asm__("" : "+r"(pointer));
  if (pointer == nullptr) __builtin_unreachable();
#endif
  return pointer;
}

/// As in_register(), a number.
template <class Number>
SWARMTALK_AVR_INLINED Number in_register(Number number) {
#ifdef __AVR__
  __asm__("" : "+r"(number));
#endif
  return number;
}

/// A member that start() sets to zero, and on AVR is zero already: see SWARMTALK_PART.
template <class T>
SWARMTALK_AVR_INLINED void set_zero(T& member) {
#ifndef __AVR__
  memset(static_cast<void*>(&member), 0, sizeof(member));
#else
  (void)member;
#endif
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
SWARMTALK_AVR_INLINED Word one_bit(uint8_t place) {
#ifdef __AVR__
  if (!__builtin_constant_p(place)) return shifted_bit<Word>(place);
#endif
  return static_cast<Word>(Word{1} << place);
}

}  // namespace core
}  // namespace swarmtalk
