// A program for Kilobots out of an Intel HEX file: its bytes, where they all fit.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace swarmtalk::cli {

/// Where programs of Kilobots end: 220 pages of 128 bytes.
inline constexpr std::size_t kProgramBytesMax = 220 * 128;

struct HexImage {
  std::vector<std::uint8_t> bytes;  // from address 0; gaps are 0xFF, as erased flash
  std::string problem;              // not empty: one sentence, and no bytes
};

/// @param text  the whole file
HexImage parse_hex_file(const std::string& text);

/// Why these bytes cannot be a robot's program, or "". A robot that was given another AVR's program
/// hears no infrared light any more, and with that nothing that would replace it. The light comes
/// with interrupt 23 of the ATmega328P, the analog comparator's: what is no program for Kilobots
/// has nothing there, so the entry leads where those of all unused interrupts lead.
std::string why_no_kilobot_program(const std::vector<std::uint8_t>& bytes);

}  // namespace swarmtalk::cli
