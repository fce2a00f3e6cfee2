#include "platforms/kilobot/clock.hpp"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <util/atomic.h>

namespace swarmtalk {
namespace kilobot {

namespace {

volatile uint32_t tick_count;
volatile bool is_awake;  // work came up since the main loop last looked

}  // namespace

ISR(TIMER0_OVF_vect) {
  ++tick_count;
  is_awake = true;
}

ISR(TIMER0_COMPB_vect) {
  is_awake = true;
}

void start_clock() {
  tick_count = 0;
  TCCR0A = 0;
  TCNT0 = 0;
  TIFR0 = (1 << TOV0) | (1 << OCF0B);
  TIMSK0 = (1 << TOIE0) | (1 << OCIE0B);
  TCCR0B = (1 << CS02) | (1 << CS00);
}

uint32_t ticks() {
  uint32_t count;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    count = tick_count;
  }
  return count;
}

uint16_t units() {
  uint8_t high;
  uint8_t low;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    low = TCNT0;
    high = static_cast<uint8_t>(tick_count);
    // Wrapped since interrupts went off: the interrupt that counts it has yet to run.
    if ((TIFR0 & (1 << TOV0)) != 0 && low < 128) ++high;
  }
  return static_cast<uint16_t>((static_cast<uint16_t>(high) << 8) | low);
}

void wake_up() {
  is_awake = true;
}

void sleep_until(uint16_t due) {
  SMCR = SLEEP_MODE_IDLE | (1 << SE);
  // The compare counts within one tick; the overflow wakes for anything beyond. Compare value 0
  // would be the overflow itself.
  const uint8_t low = static_cast<uint8_t>(due);
  OCR0B = low == 0 ? uint8_t{1} : low;
  TIFR0 = 1 << OCF0B;
  cli();
  while (!is_awake && !has_come(units(), due)) {
    sei();  // takes effect after the next instruction, so no interrupt is missed in between
    sleep_cpu();
    cli();
  }
  is_awake = false;
  sei();
}

}  // namespace kilobot
}  // namespace swarmtalk
