#include "emulation/kilobot/eeprom.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include "emulation/kilobot/image.hpp"
#include "emulation/kilobot/signal_model.hpp"
#include "hex/intel_hex.hpp"
#include "text/encoding.hpp"

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

/// Where avr-gcc puts it: a file that has it there may hold the program as well.
bool is_in_eeprom_space(const hex::Block& block) {
  return block.address >> 16 == 0x81;
}

Eeprom eeprom_of(const std::string& path, const std::vector<hex::Block>& blocks) {
  Eeprom eeprom(kEepromBytes, 0xFF);
  const bool has_space = std::any_of(blocks.begin(), blocks.end(), is_in_eeprom_space);
  for (const hex::Block& block : blocks) {
    if (has_space && !is_in_eeprom_space(block)) continue;
    const std::size_t at = has_space ? block.address & 0xFFFF : block.address;
    if (at + block.bytes.size() > kEepromBytes) {
      throw std::runtime_error(path + ": line " + std::to_string(block.line) +
                               ": beyond the 1024 bytes of EEPROM");
    }
    std::copy(block.bytes.begin(), block.bytes.end(),
              eeprom.begin() + static_cast<std::ptrdiff_t>(at));
  }
  return eeprom;
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
  std::string file{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const hex::IntelHex hex = hex::parse_intel_hex(file);
  if (hex.problem.empty()) return eeprom_of(path, hex.blocks);
  const auto fail = [&](const std::string& what) { throw std::runtime_error(path + ": " + what); };
  if (text::without_mark(file).starts_with(':')) fail(hex.problem);
  if (file.size() > kEepromBytes) {
    const std::string problem = text::encoding_problem(file);
    fail(problem.empty() ? "longer than the 1024 bytes of EEPROM" : problem);
  }
  file.resize(kEepromBytes, '\xFF');
  return Eeprom(file.begin(), file.end());
}

void save_eeprom(const std::string& path, const Eeprom& eeprom) {
  std::ofstream stream(path, std::ios::binary);
  stream.write(reinterpret_cast<const char*>(eeprom.data()),
               static_cast<std::streamsize>(eeprom.size()));
  if (!stream.flush()) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace swarmtalk::emulator
