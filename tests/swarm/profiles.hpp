// The nine-byte packet of the paper with much and with little memory.
#pragma once

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core::testing {

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

}  // namespace swarmtalk::core::testing
