// Infrared sender with carrier sense: listens before and during the leading byte, and gives way.
#pragma once

#include <stdint.h>

#include "kilobot_wire/ir_message.hpp"

namespace swarmtalk {
namespace kilobot {

/// Reads from EEPROM which pins of port B carry infrared LEDs.
void start_sender();

/// Sends `message`, 4.4 ms with interrupts off and the receiver deaf.
/// @return false if the air was taken: nothing but the start pulse has been sent, at most 0.3 ms
bool send_ir(const IrMessage& message);

}  // namespace kilobot
}  // namespace swarmtalk
