// Single readings of the analogue-digital converter, which otherwise belongs to the infrared
// receiver: a reading is impossible while a message arrives.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint8_t kAdcHighGain = 0;  // signal strength, amplified
constexpr uint8_t kAdcLowGain = 1;   // signal strength
constexpr uint8_t kAdcBattery = 6;
constexpr uint8_t kAdcLight = 7;
/// Against the processor's own 1.1 V, as the sensor needs it, and slowly.
constexpr uint8_t kAdcTemperature = 8 | 0xC0;

/// A reading of `channel`, 0 to 1023 of the reference; -1 while a message arrives. Interrupts are
/// off for the reading, about 130 cycles, for the temperature 2100. Source: ATmega328P data sheet,
/// sec. 24.
int16_t read_adc(uint8_t channel);

inline int16_t read_battery() {
  return read_adc(kAdcBattery);
}
inline int16_t read_light() {
  return read_adc(kAdcLight);
}
inline int16_t read_temperature() {
  return read_adc(kAdcTemperature);
}

}  // namespace kilobot
}  // namespace swarmtalk
