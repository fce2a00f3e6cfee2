// The main loop of a robot: hands received messages to control or program, lets the program run
// while the robot is RUNNING, and sends what it has to say. Everything the program sees is called
// from here, never from an interrupt.
#pragma once

#include <stdint.h>

#include "platforms/kilobot/backoff.hpp"
#include "platforms/kilobot/control.hpp"
#include "platforms/kilobot/ir_receiver.hpp"

namespace swarmtalk {
namespace kilobot {

/// What a program gives to the main loop; all of it must be there.
struct Program {
  void (*setup)();                         // once, at the first RUN since the program started
  void (*loop)();                          // while RUNNING, about every 4 ms; must not wait
  void (*receive)(const IrReception& ir);  // each message of a type below kIrFirstControl
  bool (*next)(IrMessage& out);            // the message to send now; false: none. RUNNING only
};

/// Mean time between two messages of one robot, 65 ms: with nine robots in earshot that always
/// have something to say the air is half taken, and most of it arrives.
constexpr uint16_t kDefaultSpacing = 2 * kUnitsPerTick;

/// Brings the hardware up and never returns.
/// @param spacing  mean time between two messages of this robot, in units of 128 us; shorter ones
///                 than Backoff::kLeastSpacing count as that
[[noreturn]] void run_program(const Program& program, uint16_t spacing = kDefaultSpacing);

/// The robot's state, uid, motor calibration and motors.
Control& control();

}  // namespace kilobot
}  // namespace swarmtalk
