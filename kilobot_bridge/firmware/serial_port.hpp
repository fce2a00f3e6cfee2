// The ATmega328P's serial port at 38400 8N1 (38461.5 at 8 MHz, +0.16 %). A Kilobot only sends: its
// receive pin is the charger's signal. Sending is polled, because interrupts would shift the
// receiver's timing.
#pragma once

#include <avr/io.h>
#include <stdint.h>

namespace swarmtalk {
namespace kilobot_bridge {

constexpr uint16_t kBaudDivider = 12;  // 8 MHz / 16 / 38400 - 1

/// @param enables  TXEN0, RXEN0, RXCIE0 as wanted
inline void start_serial(uint8_t enables) {
  UBRR0 = kBaudDivider;
  UCSR0A = 0;
  UCSR0C = (1 << UCSZ01) | (1 << UCSZ00);
  UCSR0B = enables;
}

/// Whether a byte can be handed over without waiting.
inline bool can_write_serial() {
  return (UCSR0A & (1 << UDRE0)) != 0;
}

inline void write_serial(uint8_t byte) {
  UDR0 = byte;
}

}  // namespace kilobot_bridge
}  // namespace swarmtalk
