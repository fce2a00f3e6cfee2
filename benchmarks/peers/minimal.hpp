// What the minimal daemon and its program agree on. Local socket: stream; each message behind its
// size, 2 bytes, little-endian. On the wire: Ethernet broadcasts of kEtherType, filled with as many
// such records as one read of the local socket brought.
#pragma once

#include <cstdint>

namespace peers {

constexpr std::uint16_t kEtherType = 0x88B6;  // local experiments, IEEE 802; not swarmtalkd's
constexpr std::uint32_t kFrameBytes = 1514;
constexpr std::uint32_t kEtherHeaderBytes = 14;
constexpr std::uint32_t kSizeBytes = 2;

}  // namespace peers
