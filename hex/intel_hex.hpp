// Intel HEX: the bytes of the file that a linker makes of a program, and where they lie. Strict:
// what is not exactly right is a problem with its line, for a program that is loaded half may need
// a programmer to get rid of. What editors, shells and mail do to a text file between its records
// changes no byte and is passed over. No state.
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

/// @param text  the whole file. Lines end with LF, CR LF, CR CR LF or CR; a byte order mark, blanks
///   around a record, empty lines and those that begin with ; or # are left out, and after the
///   end record zeros and Ctrl-Z, too
IntelHex parse_intel_hex(std::string_view text);

/// Why a block is not for the program's flash, with the command that leaves such out, if its
/// address is one that avr-gcc gives to EEPROM, fuses, lock bits or signature; else empty.
std::string beside_program_problem(const Block& block);

}  // namespace swarmtalk::hex
