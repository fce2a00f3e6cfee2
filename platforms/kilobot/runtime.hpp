// The main loop of a robot: hands received messages to control or program, lets the program run
// while the robot is RUNNING, and sends what it has to say. Everything the program sees is called
// from here, never from an interrupt.
#pragma once

#include <stdint.h>

#include "platforms/kilobot/control.hpp"
#include "platforms/kilobot/ir_receiver.hpp"
#include "platforms/kilobot/turns.hpp"

namespace swarmtalk {
namespace kilobot {

/// What a program gives to the main loop; all of it must be there.
struct Program {
  void (*setup)();                         // once, at the first RUN since the program started
  void (*loop)();                          // while RUNNING, about every 4 ms; must not wait
  void (*receive)(const IrReception& ir);  // each message of a type below kIrFirstControl
  bool (*next)(IrMessage& out);            // the message to send now; false: none. RUNNING only
};

/// Time from one turn to the next, 102 ms. Shorter, and robots that have two dozen others within
/// two hops find no slots for all; longer, and what they hear is older.
constexpr uint16_t kDefaultPeriod = 20 * Turns::kSlotUnits;

/// Brings the hardware up and never returns.
/// @param period  from one turn to the next in units of 128 us, whole slots; longer where many are
///                heard
[[noreturn]] void run_program(const Program& program, uint16_t period = kDefaultPeriod);

/// The type of a message with a packet of the Kilobot profile, sent now: it may report that
/// messages have met.
uint8_t swarmtalk_type();

/// The robot's state, uid, motor calibration and motors.
Control& control();

}  // namespace kilobot
}  // namespace swarmtalk
