// Checksums that a profile may put in the last byte of a packet. Pure functions.
#pragma once

#include <stdint.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

enum class Checksum : uint8_t {
  kNone,  // the link has its own (Wi-Fi, Kilobot infrared with its CRC-16)
  kSum8,  // sum of all bytes before it, mod 256; misses swapped bytes and the all-zero packet
  kCrc8,  // polynomial x^8+x^2+x+1 (0x07), start 0xFF; finds all errors of up to 3 bits in 14 bytes
};

/// Sum of `size` bytes mod 256. Cost: one addition per byte.
SWARMTALK_AVR_CALLED inline uint8_t sum8(const uint8_t* bytes, uint16_t size) {
  uint8_t sum = 0;
  for (uint16_t i = 0; i < size; ++i) sum = static_cast<uint8_t>(sum + bytes[i]);
  return sum;
}

/// CRC-8 with polynomial 0x07, start 0xFF, not reflected, no final XOR ("CRC-8" of ITU-T I.432.1
/// except for its start value, which makes the all-zero packet wrong). Without a table: 16 bytes
/// of RAM on AVR are worth more than the 60 cycles per byte.
inline uint8_t crc8(const uint8_t* bytes, uint16_t size) {
  uint8_t crc = 0xFF;
  for (uint16_t i = 0; i < size; ++i) {
    crc = static_cast<uint8_t>(crc ^ bytes[i]);
    for (uint8_t bit = 0; bit < 8; ++bit) {
      const bool carry = (crc & 0x80) != 0;
      crc = static_cast<uint8_t>(crc << 1);
      if (carry) crc = static_cast<uint8_t>(crc ^ 0x07);
    }
  }
  return crc;
}

/// The checksum of kind `kKind` over `size` bytes; 0 for kNone.
template <Checksum kKind>
inline uint8_t checksum(const uint8_t* bytes, uint16_t size) {
  return kKind == Checksum::kSum8   ? sum8(bytes, size)
         : kKind == Checksum::kCrc8 ? crc8(bytes, size)
                                    : uint8_t{0};
}

}  // namespace core
}  // namespace swarmtalk
