// Test image: leaves what comes in on the UART unread for 20 ms after the first byte, then reads
// what is left, then resets itself by the watchdog at the byte 'R'.
#include <avr/io.h>
#include <avr/wdt.h>
#include <stdint.h>

volatile uint8_t read_count;
volatile uint8_t last_byte;

static bool has_byte() {
  return UCSR0A & (1 << RXC0);
}

int main() {
  MCUSR = 0;
  wdt_disable();
  UBRR0 = 12;  // 38400 baud at 8 MHz
  UCSR0B = 1 << RXEN0;
  while (!has_byte()) {
  }
  __builtin_avr_delay_cycles(160000);
  for (;;) {
    if (!has_byte()) continue;
    last_byte = UDR0;
    ++read_count;
    if (last_byte == 'R') {
      wdt_enable(WDTO_15MS);
      for (;;) {
      }
    }
  }
}
