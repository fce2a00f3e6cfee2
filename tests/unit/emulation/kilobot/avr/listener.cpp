// Test image: receives messages by the analog comparator's interrupt, measures their strength with
// the converter's trigger, counts them, and reports each one's first byte on the UART. Its EEPROM
// is read once, to see that the emulator has filled it.
#include <avr/eeprom.h>

#include "tests/unit/emulation/kilobot/avr/infrared_line.hpp"

using infrared_line::kBitCycles;
using infrared_line::kMessageBytes;

volatile uint8_t heard_count;
volatile uint8_t damaged_count;
volatile uint16_t high_gain;
volatile uint16_t low_gain;
volatile uint16_t uid;
volatile uint8_t last_data[kMessageBytes];

static uint8_t buffer[kMessageBytes];
static uint8_t byte_index;  // 0: leading byte
static uint8_t value;
static bool is_in_byte;

static uint16_t converted() {
  while (ADCSRA & (1 << ADSC)) {
  }
  return ADC;
}

static void give_up() {
  is_in_byte = false;
  byte_index = 0;
  ADMUX = 0;
  TIMSK1 = 0;
}

ISR(TIMER1_COMPA_vect) {
  give_up();
}

static void begin_byte() {
  TCNT1 = 0;
  TIFR1 = 1 << OCF1A;
  TIMSK1 = 1 << OCIE1A;
  is_in_byte = true;
  value = 0;
}

static void end_byte() {
  is_in_byte = false;
  if (byte_index > 0) buffer[byte_index - 1] = value;
  if (byte_index++ < kMessageBytes) return;
  const bool is_good = infrared_line::crc(buffer, 10) == (buffer[10] | uint16_t(buffer[11]) << 8);
  if (is_good) {
    for (uint8_t i = 0; i < kMessageBytes; ++i) last_data[i] = buffer[i];
    ++heard_count;
  } else {
    ++damaged_count;
  }
  give_up();
}

ISR(ANALOG_COMP_vect) {
  const uint16_t since = TCNT1;
  if (!is_in_byte) {
    begin_byte();
    if (byte_index == 0) {
      high_gain = converted();
      ADMUX = 1;
      ACSR |= 1 << ACI;
    }
    return;
  }
  if (since <= kBitCycles / 2) return give_up();
  // Divided by 268.6: a division would take longer than a bit.
  const uint8_t bit = uint8_t(uint32_t(since - kBitCycles / 2) * 244 >> 16);
  if (bit < 8 && byte_index > 0)
    value |= uint8_t(1 << bit);
  else if (bit == 8)
    end_byte();
  else
    give_up();
  if (byte_index == 1 && !is_in_byte) low_gain = converted();
}

int main() {
  uid = eeprom_read_word(reinterpret_cast<const uint16_t*>(0xB0));
  infrared_line::start_uart();
  TCCR1B = 1;
  OCR1A = 11 * kBitCycles;
  ADCSRB = 1;  // triggered by the comparator
  ADCSRA = 1 << ADEN | 1 << ADATE | 3;
  ACSR = 1 << ACI | 1 << ACIE | 1 << ACIS1 | 1 << ACIS0;  // rising edges
  sei();
  uint8_t reported = 0;
  for (;;) {
    if (reported == heard_count) continue;
    reported = heard_count;
    DDRD |= 1 << 5;  // red
    infrared_line::put(last_data[0]);
    infrared_line::put('\n');
  }
}
