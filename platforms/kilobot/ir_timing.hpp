// Bit timing of the infrared link. A byte is ten slots: start pulse, eight data bits, lowest first
// (a pulse is a 1), stop pulse. A message is a leading byte with neither data nor meaning, in which
// the sender listens for others, and 12 bytes: 130 slots, 4.37 ms.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint32_t kCpuHz = UINT32_C(8000000);

/// CPU cycles of one slot: 33.6 us, about 29.7 kbit/s.
constexpr uint16_t kIrSlotCycles = 269;
constexpr uint16_t kIrHalfSlotCycles = kIrSlotCycles / 2;
/// CPU cycles for which the LED is on in a pulse: 1.125 us.
constexpr uint8_t kIrPulseCycles = 9;
constexpr uint8_t kIrSlotsPerByte = 10;
/// Slot of the leading byte in which a sender starts to listen: its own light has died away.
constexpr uint8_t kIrFirstListenSlot = 2;
/// A pulse this late after its byte's start is no longer the stop pulse.
constexpr uint16_t kIrByteEndCycles = kIrHalfSlotCycles + 9 * kIrSlotCycles;
/// Without a pulse for so long after a start pulse the message has ended.
constexpr uint16_t kIrSilenceCycles = 11 * kIrSlotCycles;

}  // namespace kilobot
}  // namespace swarmtalk
