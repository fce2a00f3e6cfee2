// The least that an ATmega328P program needs to send and receive infrared messages of Kilobots: for
// the emulator's own tests, so that they need no firmware. Busy waiting, no carrier sense.
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

namespace infrared_line {

const uint16_t kBitCycles = 269;
const uint8_t kMessageBytes = 12;

inline uint16_t crc(const uint8_t* bytes, uint8_t size_bytes) {
  uint16_t value = 0xFFFF;
  while (size_bytes-- > 0) {
    value ^= *bytes++;
    for (uint8_t bit = 0; bit < 8; ++bit)
      value = (value & 1) ? uint16_t((value >> 1) ^ 0x8408) : uint16_t(value >> 1);
  }
  return value;
}

/// A pulse of about one microsecond when Timer 1 reaches a count.
inline void pulse_at(uint16_t count) {
  while (TCNT1 < count) {
  }
  PORTB |= 1;
  __builtin_avr_delay_cycles(7);
  PORTB &= uint8_t(~1);
}

/// Sends 12 bytes; 4.4 ms with interrupts off.
inline void send(const uint8_t* message) {
  const uint8_t saved = SREG;
  cli();
  DDRB |= 1;
  TCCR1B = 1;  // no prescaler
  TCNT1 = 0;
  uint16_t start = 40;
  pulse_at(start);
  pulse_at(start + 9 * kBitCycles);
  start += 10 * kBitCycles;
  for (uint8_t i = 0; i < kMessageBytes; ++i) {
    pulse_at(start);
    for (uint8_t bit = 0; bit < 8; ++bit)
      if (message[i] & (1 << bit)) pulse_at(start + (bit + 1) * kBitCycles);
    pulse_at(start + 9 * kBitCycles);
    start += 10 * kBitCycles;
  }
  SREG = saved;
}

inline void start_uart() {  // 38400 8N1 at 8 MHz
  UBRR0 = 12;
  UCSR0B = 1 << TXEN0;
}

inline void put(uint8_t byte) {
  while (!(UCSR0A & (1 << UDRE0))) {
  }
  UDR0 = byte;
}

}  // namespace infrared_line
