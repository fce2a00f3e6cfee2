// Profiles of tests: the nine-byte packet of the paper and the `wifi` profile with other memory and
// other fields. A profile that one test alone needs stands there.
#pragma once

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::core::testing {

// --- memory -----------------------------------------------------------------------------------

/// Memory for every packet of every neighbour. Its longer queue lets copies wander for longer (each
/// hop up to 50 slots), so that messages have to be remembered longer as well.
struct RoomForAll : Kilobot {
  static constexpr uint32_t kFloodTicks = 12000;
  static constexpr uint16_t kFragmentSlots = 300;
  static constexpr uint16_t kRecords = 200;
  static constexpr uint16_t kBuckets = 64;
  static constexpr uint16_t kForwardSlots = 50;
  static constexpr uint32_t kBufferBudgetBytes = 8192;
};

/// Memory for 20 packets and 10 to forward.
struct RoomFor20 : Kilobot {
  static constexpr uint16_t kFragmentSlots = 20;
};

/// The same, and each packet sent on twice.
struct RoomFor20Repeating : RoomFor20 {
  static constexpr uint8_t kForwardRepeats = 1;
};

/// Memory for every packet and message of 36 robots that all flood; the time limits are the
/// Kilobot's own but for how long a flooded message may be remembered.
struct FloodRoom : Kilobot {
  static constexpr uint32_t kFloodTicks = 12000;
  static constexpr uint16_t kForwardSlots = 320;
  static constexpr uint16_t kRecords = 600;
  static constexpr uint16_t kBuckets = 64;
  static constexpr uint16_t kFragmentSlots = 2500;
  static constexpr uint32_t kBufferBudgetBytes = 65536;
  using Counter = uint32_t;
};

/// The same with an assembly time that no queue outlasts.
struct PatientFloodRoom : FloodRoom {
  static constexpr uint32_t kAssemblyTicks = 2000;
};

/// The wifi profile with packets just long enough for a tag: messages of several are short.
struct ShortWifi : Wifi {
  static constexpr uint16_t kMtuBytes = 22;
  static constexpr uint32_t kMaxMessageBytes = 40;
  static constexpr uint8_t kTimestampBits = 16;
};

// --- fields -----------------------------------------------------------------------------------

/// Every field of the `wifi` profile at its widest.
struct WideFields : ProfileDefaults {
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
  static constexpr uint8_t kClockBits = 32;
  static constexpr bool kPadded = false;
};

/// The classic format: no mark on timestamped packets, which have one byte of payload.
struct ShortUnmarked : Kilobot {
  static constexpr uint32_t kTimestampedFrom = kNoTimestampedChannels;
  static constexpr uint8_t kTimestampBits = 32;
  static constexpr uint8_t kClockBits = 32;
  static constexpr uint32_t kMaxMessageBytes = 7;
};

/// Packets of every length from the header's 3 bytes, and timestamps of 4 bytes that nothing marks.
struct UnmarkedLengths : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr bool kPadded = false;
  static constexpr uint8_t kTimestampBits = 32;
  static constexpr uint8_t kClockBits = 32;
};

}  // namespace swarmtalk::core::testing
