#include "emulation/kilobot/eeprom.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "emulation/kilobot/image.hpp"
#include "emulation/kilobot/signal_model.hpp"

namespace swarmtalk::emulator {
namespace {

// Addresses that the standard Kilobot programs share.
constexpr std::size_t kTurnLeft = 0x05, kTurnRight = 0x09, kStraightLeft = 0x0C;
constexpr std::size_t kStraightRight = 0x14, kLowGainTable = 0x20, kHighGainTable = 0x50;
constexpr std::size_t kTransmitMask = 0x90, kUid = 0xB0;

void put_big_endian(Eeprom& eeprom, std::size_t at, std::uint16_t value) {
  eeprom[at] = static_cast<std::uint8_t>(value >> 8);
  eeprom[at + 1] = static_cast<std::uint8_t>(value);
}

}  // namespace

Eeprom make_eeprom(const Calibration& calibration) {
  Eeprom eeprom(kEepromBytes, 0xFF);
  eeprom[kTurnLeft] = calibration.turn_left;
  eeprom[kTurnRight] = calibration.turn_right;
  eeprom[kStraightLeft] = calibration.straight_left;
  eeprom[kStraightRight] = calibration.straight_right;
  eeprom[kTransmitMask] = calibration.transmit_mask;
  eeprom[kUid] = static_cast<std::uint8_t>(calibration.uid);
  eeprom[kUid + 1] = static_cast<std::uint8_t>(calibration.uid >> 8);
  for (int i = 0; i < kCalibrationEntries; ++i) {
    const SignalStrength entry = calibration_entry(i);
    put_big_endian(eeprom, kLowGainTable + 2 * static_cast<std::size_t>(i), entry.low_gain);
    put_big_endian(eeprom, kHighGainTable + 2 * static_cast<std::size_t>(i), entry.high_gain);
  }
  return eeprom;
}

Eeprom load_eeprom(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error(path + ": cannot be opened");
  Eeprom eeprom{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!eeprom.empty() && eeprom[0] == ':')
    eeprom = load_image(path).flash;
  else if (eeprom.size() > kEepromBytes)
    throw std::runtime_error(path + ": longer than the 1024 bytes of EEPROM");
  eeprom.resize(kEepromBytes, 0xFF);
  return eeprom;
}

void save_eeprom(const std::string& path, const Eeprom& eeprom) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(eeprom.data()),
               static_cast<std::streamsize>(eeprom.size()));
  if (!stream.flush()) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace swarmtalk::emulator
