// CRC-32 as in MCAP, zip and Ethernet: polynomial 0x04C11DB7, reflected. A pure function.
#pragma once

#include <cstdint>
#include <string_view>

namespace swarmtalk::recording {

/// @param before  the CRC of the bytes before these, 0: there are none
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

}  // namespace swarmtalk::recording
