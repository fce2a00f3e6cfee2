// Test image: sleeps in power-down, from which only the watchdog may wake it (every 64 ms),
// although Timer 0 would interrupt it every 2 ms.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stdint.h>

volatile uint8_t watchdog_count;
volatile uint8_t timer_count;

ISR(WDT_vect) {
  ++watchdog_count;
}
ISR(TIMER0_OVF_vect) {
  ++timer_count;
}

int main() {
  TCCR0B = 3;  // 8 MHz / 64
  TIMSK0 = 1 << TOIE0;
  set_sleep_mode(SLEEP_MODE_PWR_DOWN);
  sei();
  for (;;) {
    wdt_enable(WDTO_60MS);
    WDTCSR |= 1 << WDIE;
    sleep_mode();
  }
}
