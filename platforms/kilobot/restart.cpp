#include "platforms/kilobot/restart.hpp"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "platforms/kilobot/board.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

/// 8 s, and what happens then. The first write opens the register for four cycles (data sheet
/// sec. 11.8.2).
void set_watchdog(uint8_t action) {
  wdt_reset();
  WDTCSR = (1 << WDCE) | (1 << WDE);
  WDTCSR = static_cast<uint8_t>(action | (1 << WDP3) | (1 << WDP0));
}

/// Function pointers count flash in words.
[[noreturn]] void jump(uint16_t byte_address) {
  stop_board();
  reinterpret_cast<void (*)()>(byte_address / 2)();
  __builtin_unreachable();
}

}  // namespace

/// After a reset by the watchdog it would go on, faster than a program starts.
extern "C" void __attribute__((naked, used, section(".init3"))) swarmtalk_stop_watchdog() {
  MCUSR = 0;
  wdt_disable();
}

/// Interrupts work, so the robot can be reached: the next 8 s begin.
ISR(WDT_vect) {
  WDTCSR |= 1 << WDIE;
}

void enter_bootloader() {
  jump(kBootloaderAddress);
}

void restart_program() {
  jump(0);
}

void start_guard() {
  cli();
  set_watchdog((1 << WDIE) | (1 << WDE));
  sei();
}

void feed_guard() {
  wdt_reset();
}

void sleep_deeply() {
  cli();
  const uint8_t timer = TIMSK0;
  TIMSK0 = 0;
  ADCSRA = 0;
  set_watchdog(1 << WDIE);
  SMCR = SLEEP_MODE_PWR_DOWN | (1 << SE);
  sei();
  sleep_cpu();
  TIMSK0 = timer;
  start_guard();
}

}  // namespace kilobot
}  // namespace swarmtalk
