#include "emulation/kilobot/skip_repair.hpp"

#include <simavr/sim_avr.h>

#include "emulation/kilobot/image.hpp"

namespace swarmtalk::emulator {
namespace {

// An opcode that the ATmega328P does not have and that simavr reports without doing anything.
constexpr std::uint16_t kMarker = 0x0001;

std::uint16_t word_at(const std::uint8_t* flash, std::uint32_t address) {
  return static_cast<std::uint16_t>(flash[address] | flash[address + 1] << 8);
}

void put_word(std::uint8_t* flash, std::uint32_t address, std::uint16_t word) {
  flash[address] = static_cast<std::uint8_t>(word);
  flash[address + 1] = static_cast<std::uint8_t>(word >> 8);
}

// Source of all encodings: Microchip DS40002198, AVR instruction set.
bool may_skip(std::uint16_t word) {
  const bool is_cpse = (word & 0xFC00) == 0x1000;
  const bool is_sbic_or_sbis = (word & 0xFD00) == 0x9900;
  const bool is_sbrc_or_sbrs = (word & 0xFC08) == 0xFC00;
  return is_cpse || is_sbic_or_sbis || is_sbrc_or_sbrs;
}

bool is_misread(std::uint16_t word) {
  const bool is_adiw_or_sbiw = (word & 0xFE00) == 0x9600;
  return is_adiw_or_sbiw && (word & 0x000C) == 0x000C;
}

}  // namespace

void SkipRepair::scan(avr_t* avr) {
  std::erase_if(replaced_,
                [&](const auto& one) { return word_at(avr->flash, one.first) != kMarker; });
  for (std::uint32_t address = 0; address + 4 <= kFlashBytes; address += 2) {
    const std::uint16_t next = word_at(avr->flash, address + 2);
    if (!is_misread(next) || !may_skip(word_at(avr->flash, address))) continue;
    replaced_[address + 2] = next;
    put_word(avr->flash, address + 2, kMarker);
  }
}

bool SkipRepair::execute(avr_t* avr) const {
  const auto found = replaced_.find(avr->pc);
  if (found == replaced_.end() || word_at(avr->flash, avr->pc) != kMarker) return false;
  const std::uint16_t opcode = found->second;
  const bool is_subtraction = (opcode & 0x0100) != 0;
  const unsigned low = 24 + ((opcode >> 3) & 6u);
  const unsigned constant = ((opcode >> 2) & 0x30u) | (opcode & 0xFu);
  const unsigned before = avr->data[low] | unsigned{avr->data[low + 1]} << 8;
  const unsigned after = (is_subtraction ? before - constant : before + constant) & 0xFFFF;
  avr->data[low] = static_cast<std::uint8_t>(after);
  avr->data[low + 1] = static_cast<std::uint8_t>(after >> 8);
  const bool was_high = (before & 0x8000) != 0, is_high = (after & 0x8000) != 0;
  const bool rises = !was_high && is_high, falls = was_high && !is_high;
  avr->sreg[S_C] = is_subtraction ? rises : falls;
  avr->sreg[S_V] = is_subtraction ? falls : rises;
  avr->sreg[S_N] = is_high;
  avr->sreg[S_Z] = after == 0;
  avr->sreg[S_S] = avr->sreg[S_N] ^ avr->sreg[S_V];
  avr->cycle += 1;  // it takes two cycles, the invalid one counts for one
  return true;
}

void SkipRepair::undo(std::uint8_t* flash) const {
  for (const auto& [address, opcode] : replaced_)
    if (word_at(flash, address) == kMarker) put_word(flash, address, opcode);
}

}  // namespace swarmtalk::emulator
