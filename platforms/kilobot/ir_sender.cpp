#include "platforms/kilobot/ir_sender.hpp"

#include <avr/io.h>
#include <util/atomic.h>

#include "platforms/kilobot/board.hpp"
#include "platforms/kilobot/eeprom.hpp"
#include "platforms/kilobot/ir_receiver.hpp"
#include "platforms/kilobot/ir_waveform.hpp"

namespace swarmtalk {
namespace kilobot {

namespace {

uint8_t transmit_pins;

/// Lights the LEDs for kIrPulseCycles: one cycle for the second write, the rest waiting.
__attribute__((noinline)) void pulse() {
  const uint8_t dark = PORTB;  // both in registers before the light goes on
  const uint8_t lit = dark | transmit_pins;
  PORTB = lit;
  __builtin_avr_delay_cycles(kIrPulseCycles - 1);
  PORTB = dark;
}

struct Pulse {
  void operator()() const { pulse(); }
};

/// Listens through the leading byte, from the slot in which our own light has died away.
/// @return whether nobody else shines
bool is_air_free(SlotTimer& timer) {
  for (uint8_t slot = 1; slot < kIrFirstListenSlot; ++slot) timer.wait();
  timer.wait();
  ACSR = (1 << ACI) | (1 << ACIS1) | (1 << ACIS0);
  for (uint8_t slot = kIrFirstListenSlot; slot < kIrSlotsPerByte - 1; ++slot) {
    while (!timer.is_slot_over()) {
      // The level, and the flag that keeps a pulse too short to be seen.
      if ((ACSR & ((1 << ACO) | (1 << ACI))) != 0) return false;
    }
    if (slot != kIrSlotsPerByte - 2) timer.begin_slot();
  }
  return true;
}

bool transmit(const IrMessage& message, uint16_t crc) {
  SlotTimer timer;
  pulse();
  if (!is_air_free(timer)) return false;
  timer.wait();
  pulse();
  send_ir_body(timer, message, crc, Pulse());
  return true;
}

}  // namespace

void start_sender() {
  transmit_pins = read_eeprom(kEepromTransmitPins);
  if ((transmit_pins & ~kTransmitPins) != 0) transmit_pins = kDefaultTransmitPins;
  DDRB |= transmit_pins;
}

bool send_ir(const IrMessage& message) {
  const uint16_t crc = ir_crc(message);
  bool sent = false;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (!is_receiving()) {
      stop_receiver();
      sent = transmit(message, crc);
      start_receiver();
    }
  }
  return sent;
}

}  // namespace kilobot
}  // namespace swarmtalk
