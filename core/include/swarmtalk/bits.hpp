// A field of a packet header: `kWidth` bits at bit `kOffset`, counted from the most significant bit
// of byte 0. Offsets and widths are compile-time numbers and the recursion unrolls, so that no
// variable shift is left (AVR shifts one bit per cycle and has no barrel shifter).
#pragma once

#include <stdint.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {
namespace bits {

/// Big-endian number in bytes kFirst..kLast.
template <class Number, uint16_t kFirst, uint16_t kLast>
struct Bytes {
  static Number read(const uint8_t* bytes) {
    return static_cast<Number>(
        static_cast<Number>(Bytes<Number, kFirst, kLast - 1>::read(bytes) << 8) | bytes[kLast]);
  }
  static void write(uint8_t* bytes, Number number, Number mask) {
    bytes[kLast] = static_cast<uint8_t>((bytes[kLast] & ~static_cast<uint8_t>(mask)) |
                                        static_cast<uint8_t>(number));
    Bytes<Number, kFirst, kLast - 1>::write(bytes, static_cast<Number>(number >> 8),
                                            static_cast<Number>(mask >> 8));
  }
};
template <class Number, uint16_t kFirst>
struct Bytes<Number, kFirst, kFirst> {
  static Number read(const uint8_t* bytes) { return bytes[kFirst]; }
  static void write(uint8_t* bytes, Number number, Number mask) {
    bytes[kFirst] = static_cast<uint8_t>((bytes[kFirst] & ~static_cast<uint8_t>(mask)) |
                                         static_cast<uint8_t>(number));
  }
};

template <uint16_t kOffset, uint16_t kWidth>
struct Field {
  using Value = UintFor<kWidth>;
  static constexpr uint16_t kFirst = kOffset / 8;
  static constexpr uint16_t kLast = (kOffset + kWidth - 1) / 8;
  static constexpr uint8_t kShift = 7 - (kOffset + kWidth - 1) % 8;
  using Span = UintFor<(kLast - kFirst + 1) * 8>;
  static constexpr Span kMask =
      static_cast<Span>((((static_cast<Span>(1) << (kWidth - 1)) - 1) << 1 | 1));

  static Value get(const uint8_t* bytes) {
    return static_cast<Value>(static_cast<Span>(Bytes<Span, kFirst, kLast>::read(bytes) >> kShift) &
                              kMask);
  }
  static bool is_same(const uint8_t* a, const uint8_t* b) {
    return ((Bytes<Span, kFirst, kLast>::read(a) ^ Bytes<Span, kFirst, kLast>::read(b)) &
            static_cast<Span>(kMask << kShift)) == 0;
  }
  /// What byte kByte of the packet has of a field with this value: 0 outside the field.
  template <uint16_t kByte>
  static SWARMTALK_AVR_INLINED uint8_t part(Value value) {
    return kByte < kFirst || kByte > kLast
               ? uint8_t{0}
               : static_cast<uint8_t>(
                     static_cast<Span>((static_cast<Span>(value) & kMask) << kShift) >>
                     (kByte < kFirst || kByte > kLast ? 0 : (kLast - kByte) * 8));
  }
  /// Writes the low kWidth bits of `value`; the neighbours' bits stay.
  static void put(uint8_t* bytes, Value value) {
    Bytes<Span, kFirst, kLast>::write(
        bytes, static_cast<Span>((static_cast<Span>(value) & kMask) << kShift),
        static_cast<Span>(kMask << kShift));
  }
};

/// A field that the profile leaves out: reads as 0.
template <uint16_t kOffset>
struct Field<kOffset, 0> {
  using Value = uint8_t;
  static Value get(const uint8_t*) { return 0; }
  static bool is_same(const uint8_t*, const uint8_t*) { return true; }
  static void put(uint8_t*, Value) {}
  template <uint16_t kByte>
  static uint8_t part(Value) {
    return 0;
  }
};

}  // namespace bits
}  // namespace core
}  // namespace swarmtalk
