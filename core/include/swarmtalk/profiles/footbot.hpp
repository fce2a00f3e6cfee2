// Foot-bot (ARGoS range and bearing, 10 bytes): one link byte (footbot_frame.hpp), which tells new
// from old and the packet's length, and a packet of up to 9 bytes: 3 header, 5 payload, 1 checksum.
// Because the link tells lengths, messages keep theirs exactly.
#pragma once

#include "swarmtalk/profile.hpp"
#include "swarmtalk/sensing.hpp"

namespace swarmtalk {
namespace core {

/// Distance in millimetres and bearing of the last transmitter. Negative distance is unknown.
struct RangeBearingSensing {
  using Distance = int16_t;
  Distance distance;
  float bearing_rad;

  bool is_within(Distance limit) const { return distance < limit; }
};

/// One tick is one step of the simulation; a robot sends at most one packet per step.
struct Footbot : ProfileDefaults {
  using Sensing = RangeBearingSensing;
  static constexpr Checksum kChecksum = Checksum::kSum8;
  static constexpr bool kPadded = false;
  static constexpr uint32_t kTimestampedFrom = 8;

  static constexpr uint16_t kChannels = 16;
  static constexpr uint16_t kForwardSlots = 64;
  static constexpr uint16_t kFragmentSlots = 600;
  static constexpr uint16_t kRecords = 512;
  static constexpr uint16_t kBuckets = 256;
  static constexpr uint32_t kBufferBudgetBytes = 65536;
  using Counter = uint32_t;

  static constexpr uint32_t kAssemblyTicks = 100;
  static constexpr uint32_t kFloodSurelyTicks = 64;
  static constexpr uint32_t kFloodTicks = 4000;
};

}  // namespace core
}  // namespace swarmtalk
