// The 1 KiB of EEPROM of a Kilobot: the fields that programs for it read, and files that hold it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmtalk::emulator {

using Eeprom = std::vector<std::uint8_t>;  // kEepromBytes long

struct Calibration {
  std::uint16_t uid = 0;
  std::uint8_t turn_left = 70;  // motor duty, of 255
  std::uint8_t turn_right = 70;
  std::uint8_t straight_left = 65;
  std::uint8_t straight_right = 65;
  std::uint8_t transmit_mask = 1;  // pins of port B that drive the infrared LED
};

/// A calibrated robot's EEPROM: the given numbers at the standard addresses and the distance tables
/// of signal_model.hpp; everything else erased (0xFF).
Eeprom make_eeprom(const Calibration& calibration);

/// Reads a raw image (at most 1024 bytes, the rest erased) or an Intel hex file.
/// @throws std::runtime_error
Eeprom load_eeprom(const std::string& path);

/// Writes 1024 raw bytes. @throws std::runtime_error
void save_eeprom(const std::string& path, const Eeprom& eeprom);

}  // namespace swarmtalk::emulator
