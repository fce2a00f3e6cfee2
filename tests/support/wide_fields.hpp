// The fields of the `wifi` profile, for profiles of tests that have them around other sizes.
#pragma once

#include "swarmtalk/profile.hpp"

namespace swarmtalk::core::testing {

/// Every field at its widest.
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

}  // namespace swarmtalk::core::testing
