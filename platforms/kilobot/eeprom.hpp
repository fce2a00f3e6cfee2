// Where a Kilobot keeps its calibration in EEPROM: the same places as in kilolib, so robots
// calibrated with its tools stay calibrated. Blank cells read 0xFF.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr uint16_t kEepromOscillator = 0x01;     // OSCCAL
constexpr uint16_t kEepromTurnLeft = 0x05;       // PWM of the left motor to turn left
constexpr uint16_t kEepromTurnRight = 0x09;      // PWM of the right motor to turn right
constexpr uint16_t kEepromStraightLeft = 0x0C;   // PWM of the left motor to go straight
constexpr uint16_t kEepromStraightRight = 0x14;  // PWM of the right motor to go straight
constexpr uint16_t kEepromLowGain = 0x20;        // 14 x uint16 big-endian, 5 mm apart
constexpr uint16_t kEepromHighGain = 0x50;       // 14 x uint16 big-endian, 5 mm apart
constexpr uint16_t kEepromTransmitPins = 0x90;   // infrared LEDs, pins of port B
constexpr uint16_t kEepromUid = 0xB0;            // uint16 little-endian

uint8_t read_eeprom(uint16_t address);
/// Writes only when the value differs (3.4 ms per byte then, and a cell wears).
void write_eeprom(uint16_t address, uint8_t value);

/// The robot's number; 0xFFFF if it never got one.
inline uint16_t read_uid() {
  return static_cast<uint16_t>(read_eeprom(kEepromUid) |
                               (static_cast<uint16_t>(read_eeprom(kEepromUid + 1)) << 8));
}

/// One entry, 0 to 13, of a calibration table at `table`.
inline uint16_t read_gain(uint16_t table, uint8_t entry) {
  const uint16_t address = static_cast<uint16_t>(table + 2 * entry);
  return static_cast<uint16_t>((static_cast<uint16_t>(read_eeprom(address)) << 8) |
                               read_eeprom(address + 1));
}

}  // namespace kilobot
}  // namespace swarmtalk
