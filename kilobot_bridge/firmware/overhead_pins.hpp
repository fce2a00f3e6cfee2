// Where an overhead controller has its infrared LEDs and its own LED, by board.
#pragma once

#include <avr/io.h>

namespace swarmtalk {
namespace kilobot_bridge {

#if defined(SWARMTALK_OVERHEAD_ARDUINO)  // an Arduino with the processor at 8 MHz
inline void start_overhead_pins() {
  DDRB = (1 << 1) | (1 << 5);
}
inline volatile uint8_t& infrared_port() {
  return PORTB;
}
inline volatile uint8_t& led_port() {
  return PORTB;
}
constexpr uint8_t kInfraredPin = 1 << 1;
constexpr uint8_t kLedPin = 1 << 5;
#else  // the overhead controller sold with the robots
inline void start_overhead_pins() {
  DDRD = 1 << 3;
  DDRB = 1 << 1;
}
inline volatile uint8_t& infrared_port() {
  return PORTD;
}
inline volatile uint8_t& led_port() {
  return PORTB;
}
constexpr uint8_t kInfraredPin = 1 << 3;
constexpr uint8_t kLedPin = 1 << 1;
#endif

}  // namespace kilobot_bridge
}  // namespace swarmtalk
