#include "cli/kilobot/hex_file.hpp"

#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>

#include "hex/intel_hex.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::uint8_t kErased = 0xFF;

// Of the ATmega328P.
constexpr std::size_t kInterrupts = 26;  // the first is reset
constexpr std::size_t kEntryBytes = 4;
constexpr std::size_t kAnalogComparator = 23;
constexpr std::uint32_t kFlashWords = 16 * 1024;

std::string shown(std::size_t address) {
  char text[2 + 2 * sizeof address + 1];
  std::snprintf(text, sizeof text, "0x%04zx", address);
  return text;
}

/// Where an entry of the interrupt table leads, in words; nullopt: it is no jump.
std::optional<std::uint32_t> target_of(const std::vector<std::uint8_t>& bytes, std::size_t entry) {
  const auto word = [&](std::size_t at) {
    return static_cast<std::uint32_t>(bytes[at] | bytes[at + 1] << 8);
  };
  const std::size_t at = entry * kEntryBytes;
  const std::uint32_t first = word(at);
  if ((first & 0xFE0E) == 0x940C) {  // JMP: the address's upper bits are beyond this chip
    return word(at + 2) % kFlashWords;
  }
  if ((first & 0xF000) != 0xC000) return std::nullopt;
  const std::uint32_t offset = first & 0x0FFF;  // RJMP: of 12 bits with a sign, from the next word
  return static_cast<std::uint32_t>(at / 2 + 1 + offset +
                                    (offset < 0x800 ? 0 : kFlashWords - 0x1000)) %
         kFlashWords;
}

HexImage refused(const hex::Block& block, const std::string& what) {
  return {{}, "line " + std::to_string(block.line) + ": " + what};
}

}  // namespace

HexImage parse_hex_file(const std::string& text) {
  const hex::IntelHex file = hex::parse_intel_hex(text);
  if (!file.problem.empty()) return {{}, file.problem};
  HexImage image;
  std::vector<bool> is_set;
  for (const hex::Block& block : file.blocks) {
    if (std::string why = hex::beside_program_problem(block); !why.empty()) return {{}, why};
    const std::size_t end = std::size_t{block.address} + block.bytes.size();
    if (end > kProgramBytesMax) {
      return refused(block,
                     "address " + shown(end - 1) + " lies after the last byte of programs, " +
                         shown(kProgramBytesMax - 1) + ": the robots' bootloader begins there");
    }
    if (image.bytes.size() < end) {
      image.bytes.resize(end, kErased);
      is_set.resize(end, false);
    }
    for (std::size_t i = 0; i < block.bytes.size(); ++i) {
      const std::size_t at = block.address + i;
      if (is_set[at] && image.bytes[at] != block.bytes[i]) {
        return refused(block, "address " + shown(at) + " has another value in a line before");
      }
      image.bytes[at] = block.bytes[i];
      is_set[at] = true;
    }
  }
  if (image.bytes.empty()) image.problem = "it holds no program";
  return image;
}

std::string why_no_kilobot_program(const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() < kInterrupts * kEntryBytes) return "it is too short for a Kilobot's program";
  std::map<std::uint32_t, int> entries;
  for (std::size_t i = 1; i < kInterrupts; ++i) {
    const auto target = target_of(bytes, i);
    if (!target) return "it does not begin with the interrupt table of a Kilobot's ATmega328P";
    ++entries[*target];
  }
  // Where the most lead, all those lead that the program does not use.
  std::uint32_t unused = 0;
  int most = 0;
  for (const auto& [target, count] : entries) {
    if (count > most) unused = target;
    most = std::max(most, count);
  }
  if (*target_of(bytes, kAnalogComparator) != unused) return "";
  return "it hears no infrared light, as every Kilobot's program does: it is for another device, "
         "such as the overhead controller, and robots that run it can be programmed no more";
}

}  // namespace swarmtalk::cli
