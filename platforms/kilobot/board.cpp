#include "platforms/kilobot/board.hpp"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "platforms/kilobot/eeprom.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

void clear_ports() {
  PORTB = 0;
  PORTC = 0;
  PORTD = 0;
  DDRB = 0;
  DDRC = 0;
  DDRD = 0;
}

/// Red: PD5, PD4; green: PC3, PC2; blue: PC5, PC4; the first of each is the weak one.
constexpr uint8_t kLedPinsD = (1 << 5) | (1 << 4);
constexpr uint8_t kLedPinsC = (1 << 5) | (1 << 4) | (1 << 3) | (1 << 2);

}  // namespace

void start_board() {
  const uint8_t trim = read_eeprom(kEepromOscillator);
  if (trim != 0xFF) OSCCAL = trim;
  clear_ports();
  PORTD = 1 << kPinCharging;  // pull-up: the charger's signal only pulls down
  DIDR1 = (1 << AIN1D) | (1 << AIN0D);
  power_receiver(true);
}

void stop_board() {
  cli();
  wdt_reset();
  MCUSR = 0;
  wdt_disable();
  ACSR = 1 << ACI;
  ADCSRA = 0;
  ADCSRB = 0;
  UCSR0B = 0;
  TIMSK0 = 0;
  TIMSK1 = 0;
  TIMSK2 = 0;
  TCCR0B = 0;
  TCCR1A = 0;
  TCCR1B = 0;
  TCCR2A = 0;
  TCCR2B = 0;
  OCR2A = 0;
  OCR2B = 0;
  clear_ports();
}

void power_receiver(bool on) {
  DDRD |= 1 << kPinReceiverPower;
  if (on) {
    PORTD |= 1 << kPinReceiverPower;
  } else {
    PORTD &= static_cast<uint8_t>(~(1 << kPinReceiverPower));
  }
}

void set_led(uint8_t rgb) {
  // A colour's lower bit is the weak pin, the upper of its pair; green and blue then lie as in port
  // C.
  const uint8_t pins = static_cast<uint8_t>(static_cast<uint8_t>((rgb & 0x55) << 1) |
                                            (static_cast<uint8_t>(rgb >> 1) & 0x55));
  DDRC = static_cast<uint8_t>((DDRC & ~kLedPinsC) | (pins & kLedPinsC));
  DDRD = static_cast<uint8_t>((DDRD & ~kLedPinsD) | (static_cast<uint8_t>(pins >> 2) & kLedPinsD));
}

bool is_charging() {
  return (PIND & (1 << kPinCharging)) == 0;
}

}  // namespace kilobot
}  // namespace swarmtalk
