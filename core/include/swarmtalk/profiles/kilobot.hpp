// Kilobot: 9 bytes of infrared payload, 3 of them header and 1 checksum, 5 for the message, as in
// Zhang et al., AAMAS 2020, fig. 1. Channels 8 to 15 are timestamped, so that every forwarder
// knows.
#pragma once

#include "swarmtalk/profile.hpp"
#include "swarmtalk/sensing.hpp"

namespace swarmtalk {
namespace core {

/// One tick is 32.768 ms (kilolib's kilo_ticks); a robot sends one packet per 16 ticks, and the
/// time limits are counted in that.
struct Kilobot : ProfileDefaults {
  using Sensing = DistanceSensing;  // millimetres, centre to centre
  static constexpr Checksum kChecksum = Checksum::kSum8;
  static constexpr uint32_t kTimestampedFrom = 8;
  static constexpr uint16_t kRecords = 20;
  using Counter = uint8_t;
};

}  // namespace core
}  // namespace swarmtalk
