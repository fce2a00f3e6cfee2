// Image: what is burnt into one processor's flash before power-on, read from an ELF file or an
// Intel hex file, with the symbols of an ELF file so that variables can be watched by name.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace swarmtalk::emulator {

inline constexpr std::uint32_t kFlashBytes = 32768;        // ATmega328P
inline constexpr std::uint32_t kBootloaderStart = 0x7000;  // byte address, 2048-word boot section
inline constexpr std::uint32_t kEepromBytes = 1024;

struct Symbol {
  std::uint16_t address = 0;  // in the data space
  std::uint16_t size_bytes = 0;
};

struct Image {
  std::vector<std::uint8_t> flash = std::vector<std::uint8_t>(kFlashBytes, 0xFF);
  std::uint32_t entry = 0;                             // byte address where the processor starts
  std::uint32_t used_bytes = 0;                        // bytes of flash that the file sets
  std::optional<std::vector<std::uint8_t>> eeprom;     // if the file has an EEPROM section
  std::map<std::string, Symbol, std::less<>> symbols;  // objects in RAM

  /// Lays the other image's bootloader section (from kBootloaderStart on) over this one's.
  /// @throws std::runtime_error if it has none
  void add_bootloader(const Image& bootloader);
};

/// Reads an ELF file (32-bit, AVR) or an Intel hex file; which of them is seen from its first byte.
/// @throws std::runtime_error naming the file and what is wrong with it
Image load_image(const std::string& path);

}  // namespace swarmtalk::emulator
