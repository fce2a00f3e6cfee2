// SkipRepair: mends one mistake of simavr 1.6. Behind an instruction that may skip the next one, it
// takes "adiw" and "sbiw" with constants that end in 12 to 15 for an instruction of two words and
// skips one word too many. Such instructions are replaced in the emulated flash by an invalid one,
// for which simavr calls its logger; there they are executed by hand. Owned by what owns
// the processor.
#pragma once

#include <cstdint>
#include <map>

struct avr_t;

namespace swarmtalk::emulator {

class SkipRepair {
 public:
  /// Looks for such places; again after the program has written to its flash.
  void scan(avr_t* avr);

  /// Executes the replaced instruction at the program counter. @return false if there is none
  bool execute(avr_t* avr) const;

  /// Puts the original instructions into a copy of the flash.
  void undo(std::uint8_t* flash) const;

  std::size_t count() const { return replaced_.size(); }

 private:
  std::map<std::uint32_t, std::uint16_t> replaced_;  // byte address, original instruction
};

}  // namespace swarmtalk::emulator
