// Wi-Fi and Ethernet: one packet fits a frame together with the air frame's own header; messages
// keep their exact length up to 16 KiB; a sender is (node, epoch), so restarts and equal ids never
// splice two messages. docs/wire-format.md draws the header.
#pragma once

#include "swarmtalk/profile.hpp"
#include "swarmtalk/sensing.hpp"

namespace swarmtalk {
namespace core {

/// One tick is 1 us.
struct Wifi : ProfileDefaults {
  using Sensing = PoseSensing;
  static constexpr uint16_t kMtuBytes = 1400;
  static constexpr uint8_t kNodeBits = 16;
  static constexpr uint8_t kMessageBits = 32;
  static constexpr uint8_t kSequenceBits = 15;
  static constexpr uint8_t kChannelBits = 16;
  static constexpr uint8_t kTtlBits = 8;
  static constexpr uint8_t kHopsBits = 8;
  static constexpr uint8_t kSizeBits = 16;
  static constexpr uint8_t kEpochBits = 16;
  static constexpr uint8_t kTimestampedBits = 1;
  static constexpr uint8_t kGatewayBits = 1;
  static constexpr uint8_t kTimestampBits = 32;
  static constexpr bool kPadded = false;
  static constexpr bool kHopsFromTtl = false;
  static constexpr bool kLimitsForwarding = true;

  static constexpr uint16_t kChannels = 64;
  static constexpr uint16_t kForwardSlots = 256;
  static constexpr uint16_t kFragmentSlots = 256;  // one pool for the node, 350 KiB
  static constexpr uint16_t kRecords = 4096;
  static constexpr uint16_t kBuckets = 4096;
  static constexpr uint32_t kMaxMessageBytes = 16384;
  static constexpr uint32_t kBufferBudgetBytes = UINT32_C(4) << 20;
  using Counter = uint64_t;

  static constexpr uint8_t kClockBits = 32;
  static constexpr uint32_t kAssemblyTicks = UINT32_C(2000000);          // 2 s
  static constexpr uint32_t kOneHopDuplicateTicks = UINT32_C(60000000);  // 1 minute
  static constexpr uint32_t kFloodSurelyTicks = UINT32_C(60000000);      // 1 minute
  static constexpr uint32_t kFloodTicks = UINT32_C(600000000);           // 10 minutes
};

}  // namespace core
}  // namespace swarmtalk
