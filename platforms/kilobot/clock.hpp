// The robot's time. Ticks of 32.768 ms (8 MHz / 1024 / 256, "31 Hz") that nothing ever hurries or
// holds, and units of 128 us for the radio's waits. Timer 0 is the clock's own; its second compare
// wakes the main loop.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint16_t kUnitsPerTick = 256;
constexpr uint16_t kMicrosecondsPerUnit = 128;
/// 30.52, as a whole number of ticks.
constexpr uint8_t kTicksPerSecond = 31;

/// Starts the clock at 0.
void start_clock();

/// Ticks since start_clock, wrapping after 4.4 years. May be called with interrupts on or off.
uint32_t ticks();

/// Units of 128 us since start_clock, wrapping after 8.4 s. Interrupts on or off.
uint16_t units();

/// Sleeps (processor idle, radio and timers awake) until `due` or an event (wake_up). Returns at
/// once if an event came since the last call, or `due` has passed; may return early.
/// @param due  units(), less than 32767 ahead
void sleep_until(uint16_t due);

/// Ends sleep_until. For interrupts that leave work to the main loop.
void wake_up();

/// Whether time `due` has come: units() has reached it less than 4.2 s ago.
inline bool has_come(uint16_t now, uint16_t due) {
  return static_cast<int16_t>(static_cast<uint16_t>(now - due)) >= 0;
}

}  // namespace kilobot
}  // namespace swarmtalk
