// The 8-byte packets of the open-source implementation of 2020, bit for bit: no checksum, 32-bit
// timestamps, messages padded to whole packets, and no mark on timestamped channels (only robots
// that registered one know). Its senders draw message numbers at random, so a number may come back
// at once; the short memory for one-hop messages keeps those apart from copies.
#pragma once

#include "swarmtalk/profile.hpp"
#include "swarmtalk/sensing.hpp"

namespace swarmtalk {
namespace core {

/// Ticks as on the Kilobot. `kWithChannelBits`: 4 in the format that was shipped, 2 in the
/// template that came with it.
template <uint8_t kWithChannelBits>
struct Classic2020Format : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 8;
  static constexpr uint8_t kChannelBits = kWithChannelBits;
  static constexpr uint8_t kTimestampBits = 32;
  static constexpr uint8_t kClockBits = 32;
};

using Classic2020 = Classic2020Format<4>;

/// The same with the 9 bytes and the checksum of the paper's figure 1.
struct Classic2020Paper : Classic2020Format<4> {
  static constexpr uint16_t kMtuBytes = 9;
  static constexpr Checksum kChecksum = Checksum::kSum8;
};

}  // namespace core
}  // namespace swarmtalk
