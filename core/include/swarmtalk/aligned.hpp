// A message for a program that casts its bytes to a struct, as the listings of Zhang et al., AAMAS
// 2020, sec. 2.3 do: at an address where any struct of numbers may lie.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// Calls `call(unsigned char*)` with `bytes`, or with a copy on the stack where they are not
/// aligned for a double (on AVR everything is aligned and nothing is copied).
template <class P, class Call>
inline void with_aligned(const uint8_t* bytes, uint16_t size, const Call& call) {
  if (reinterpret_cast<uintptr_t>(bytes) % alignof(double) == 0) {
    return call(const_cast<unsigned char*>(bytes));
  }
  alignas(double) unsigned char copy[Wire<P>::kMessageBytes];
  memcpy(copy, bytes, size);
  call(copy);
}

}  // namespace core
}  // namespace swarmtalk
