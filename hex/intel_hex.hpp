// Intel HEX: the bytes of the file that a linker makes of a program, and where they lie. Strict:
// what is not exactly right is a problem with its line, for a program that is loaded half may need
// a programmer to get rid of. A leaf; no state.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace swarmtalk::hex {

/// One data record.
struct Block {
  std::uint32_t address = 0;
  std::vector<std::uint8_t> bytes;
  std::size_t line = 0;  // counted from 1
};

struct IntelHex {
  std::vector<Block> blocks;  // in the order of the file
  std::string problem;        // not empty: one sentence, and no blocks
};

/// @param text  the whole file; lines end with LF or CR LF, empty ones are left out
IntelHex parse_intel_hex(std::string_view text);

}  // namespace swarmtalk::hex
