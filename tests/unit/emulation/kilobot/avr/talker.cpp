// Test image: sends a message with a running number eight times a second, for ever, and shows the
// number's lowest bits on its LED.
#include <string.h>

#include "tests/unit/emulation/kilobot/avr/infrared_line.hpp"

uint8_t sent_count;

int main() {
  TCCR0B = 5;  // 8 MHz / 1024
  uint8_t ticks = 0;
  DDRB |= 1;
  for (;;) {
    if (!(TIFR0 & (1 << TOV0))) continue;  // each 32.768 ms
    TIFR0 = 1 << TOV0;
    if (++ticks < 4) continue;
    ticks = 0;
    ++sent_count;
    uint8_t message[infrared_line::kMessageBytes] = {sent_count, 'h', 'e', 'l', 'l', 'o'};
    message[9] = 5;
    const uint16_t crc = infrared_line::crc(message, 10);
    message[10] = uint8_t(crc);
    message[11] = uint8_t(crc >> 8);
    infrared_line::send(message);
    DDRC = uint8_t((sent_count & 1) << 3);  // green
  }
}
