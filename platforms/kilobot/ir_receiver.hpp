// Infrared receiver: the comparator's interrupt times the pulses, the converter measures them, and
// whole messages wait in a small ring for the main loop. Owns the comparator, timer 1 and the
// converter. Nothing but decoding happens with interrupts off.
#pragma once

#include <stdint.h>

#include "kilobot_wire/ir_message.hpp"

namespace swarmtalk {
namespace kilobot {

/// A message and how strong its light was: two readings of 0 to 1023, through an amplifier
/// (saturated nearby) and without (lost in noise far away).
struct IrReception {
  IrMessage message;
  uint16_t high_gain;
  uint16_t low_gain;
};

/// Messages that may wait; one more is being received. Further ones are dropped and counted.
#if !defined(SWARMTALK_KILOBOT_IR_SLOTS)
#define SWARMTALK_KILOBOT_IR_SLOTS 4  // a power of two
#endif
constexpr uint8_t kIrWaiting = SWARMTALK_KILOBOT_IR_SLOTS - 1;

/// Begins to listen. Interrupts may be on or off.
void start_receiver();

/// Stops listening and forgets a message half received.
void stop_receiver();

/// Whether a message is just arriving: the air is taken.
bool is_receiving();

/// The oldest message that waits, or null. Valid until drop_reception().
const IrReception* next_reception();

/// Frees the message that next_reception() gave.
void drop_reception();

/// Messages lost because the ring was full; wraps.
uint16_t receptions_lost();

/// Whether something was heard since the last call that cannot be read: two messages at once.
bool take_garbled();

/// Called with each control message (type 0x80 and above) from inside the interrupt, before it is
/// queued: for what has to work even when the program hangs. Each image defines it.
void on_urgent_message(uint8_t type);

}  // namespace kilobot
}  // namespace swarmtalk
