// The Ethernet header of a ghost's frames: to all, from an address of its own.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "frame/air_frame.hpp"

namespace swarmtalk::suite {

inline constexpr std::size_t kEthernetBytes = 14;

/// Source is 02:53:54:01:HI:LO, locally administered, "ST" behind it; robots of a lab's radio have
/// 00 where ghosts have 01.
/// @param buffer  at least kEthernetBytes
inline void put_ethernet(std::span<uint8_t> buffer, uint16_t number) {
  const std::array<uint8_t, kEthernetBytes> header{
      0xFF,
      0xFF,
      0xFF,
      0xFF,
      0xFF,
      0xFF,
      0x02,
      0x53,
      0x54,
      0x01,
      static_cast<uint8_t>(number >> 8),
      static_cast<uint8_t>(number & 0xFF),
      static_cast<uint8_t>(frame::kDefaultEthertype >> 8),
      static_cast<uint8_t>(frame::kDefaultEthertype & 0xFF)};
  for (std::size_t i = 0; i < header.size(); ++i) buffer[i] = header[i];
}

}  // namespace swarmtalk::suite
