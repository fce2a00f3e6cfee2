// Puts one infrared message on the air, slot by slot. Timer 1 beats the slots, so an interrupt
// between two pulses shifts one pulse but never the rest of the message.
// Used by robots (interrupts off) and by the overhead controller (interrupts on).
#pragma once

#include <avr/io.h>
#include <stdint.h>

#include "kilobot_wire/ir_message.hpp"
#include "platforms/kilobot/ir_timing.hpp"

namespace swarmtalk {
namespace kilobot {

/// Timer 1 as metronome. Construct with the message, destroy behind it.
class SlotTimer {
 public:
  SlotTimer() {
    TCCR1B = 0;
    TCCR1A = 0;
    OCR1A = kIrSlotCycles - 1;
    TCNT1 = 0;
    TIFR1 = 1 << OCF1A;
    TCCR1B = (1 << WGM12) | (1 << CS10);
  }
  ~SlotTimer() { TCCR1B = 0; }
  SlotTimer(const SlotTimer&) = delete;
  SlotTimer& operator=(const SlotTimer&) = delete;

  bool is_slot_over() const { return (TIFR1 & (1 << OCF1A)) != 0; }
  void begin_slot() { TIFR1 = 1 << OCF1A; }
  void wait() {
    while (!is_slot_over()) {
    }
    begin_slot();
  }
};

/// Sends the ten slots of `byte`, the first after the current one.
/// @param pulse  lights the LED for kIrPulseCycles
template <class Pulse>
void send_ir_byte(SlotTimer& timer, uint8_t byte, const Pulse& pulse) {
  uint16_t slots = static_cast<uint16_t>(0x201u | (static_cast<uint16_t>(byte) << 1));
  do {
    timer.wait();
    if ((slots & 1) != 0) pulse();
    slots >>= 1;
  } while (slots != 0);
}

/// Sends the 12 bytes that follow the leading byte.
/// @param crc  as it goes on the air; ir_crc(message), unless the caller wants a damaged one
template <class Pulse>
void send_ir_body(SlotTimer& timer, const IrMessage& message, uint16_t crc, const Pulse& pulse) {
  for (uint8_t i = 0; i < kIrBodyBytes; ++i) send_ir_byte(timer, ir_body(message)[i], pulse);
  send_ir_byte(timer, static_cast<uint8_t>(crc), pulse);
  send_ir_byte(timer, static_cast<uint8_t>(crc >> 8), pulse);
}

}  // namespace kilobot
}  // namespace swarmtalk
