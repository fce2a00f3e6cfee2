#include "cli/kilobot/hex_file.hpp"

#include <cstdio>

#include "hex/intel_hex.hpp"

namespace swarmtalk::cli {
namespace {

constexpr std::uint8_t kErased = 0xFF;

std::string shown(std::size_t address) {
  char text[2 + 2 * sizeof address + 1];
  std::snprintf(text, sizeof text, "0x%04zx", address);
  return text;
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
    const std::size_t end = std::size_t{block.address} + block.bytes.size();
    if (end > kProgramBytesMax) {
      return refused(block,
                     "address " + shown(end - 1) + " lies behind the last byte of programs, " +
                         shown(kProgramBytesMax - 1) + ": there begins the robots' bootloader");
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

}  // namespace swarmtalk::cli
