// Profiles of the flood scenarios: memory for all that 36 robots flood, and the shipped ones.
#pragma once

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::core::testing {

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

}  // namespace swarmtalk::core::testing
