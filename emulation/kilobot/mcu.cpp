#include "emulation/kilobot/mcu.hpp"

#include <simavr/avr_eeprom.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_core.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <stdexcept>

#include "emulation/kilobot/atmega328p.hpp"

namespace swarmtalk::emulator {

namespace reg = atmega328p;

namespace {

constexpr std::uint8_t kStackPaint = 0xA5;
/// A program that goes astray may use any 16-bit address; simavr complains, and then does it.
std::uint8_t* widened(std::uint8_t* memory, std::size_t size_bytes) {
  constexpr std::size_t kAddressSpaceBytes = 65536;
  auto* wide = static_cast<std::uint8_t*>(std::realloc(memory, kAddressSpaceBytes + 4));
  if (wide == nullptr) throw std::bad_alloc();
  std::fill(wide + size_bytes, wide + kAddressSpaceBytes + 4, std::uint8_t{0xFF});
  return wide;
}

constexpr std::uint32_t kFlashMask = kFlashBytes - 1;  // the program counter has 14 bits (words)

}  // namespace

Mcu::Mcu(const Image& image, const Eeprom& eeprom, const McuSettings& settings)
    : image_(image), settings_(settings) {
  avr_ = avr_make_mcu_by_name("atmega328p");
  if (avr_ == nullptr) throw std::runtime_error("libsimavr does not know the ATmega328P");
  avr_init(avr_);
  avr_->flash = widened(avr_->flash, kFlashBytes);
  avr_->data = widened(avr_->data, reg::kRamEnd + 1u);
  avr_->frequency = settings.clock_hz;
  avr_->vcc = avr_->avcc = avr_->aref = kConverterMax;  // so that millivolts are counts
  avr_->log = LOG_NONE;
  std::copy(image.flash.begin(), image.flash.end(), avr_->flash);
  avr_->codeend = avr_->flashend;
  const std::uint32_t start = settings.resets_to_bootloader ? kBootloaderStart : 0;
  avr_->reset_pc = avr_->pc = image.entry >= kBootloaderStart ? image.entry : start;
  avr_->run_cycle_limit = 1;
  std::fill(avr_->data + reg::kRamStart, avr_->data + reg::kRamEnd + 1, kStackPaint);
  Eeprom contents = eeprom;
  avr_eeprom_desc_t description{contents.data(), 0, kEepromBytes};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_SET, &description);
  normal_run_ = avr_->run;
  skip_repair_.scan(avr_);
  install_hooks();
}

Mcu::~Mcu() {
  avr_terminate(avr_);
  free(avr_);
}

std::uint64_t Mcu::cycle() const {
  return avr_->cycle;
}
std::uint8_t Mcu::data(std::uint16_t address) const {
  return avr_->data[address];
}
std::uint32_t Mcu::program_counter() const {
  return avr_->pc;
}

std::vector<std::uint8_t> Mcu::flash() const {
  std::vector<std::uint8_t> contents(avr_->flash, avr_->flash + kFlashBytes);
  skip_repair_.undo(contents.data());
  return contents;
}

Eeprom Mcu::eeprom() const {
  Eeprom contents(kEepromBytes);
  avr_eeprom_desc_t description{contents.data(), 0, kEepromBytes};
  avr_ioctl(avr_, AVR_IOCTL_EEPROM_GET, &description);
  return contents;
}

std::optional<unsigned> Mcu::stack_free_bytes() const {
  const auto end = image_.symbols.find("__bss_end");
  if (end == image_.symbols.end()) return std::nullopt;
  unsigned address = end->second.address;
  while (address <= reg::kRamEnd && avr_->data[address] == kStackPaint) ++address;
  return address - end->second.address;
}

void Mcu::run_until(std::uint64_t cycle) {
  while (avr_->cycle < cycle && !is_dead()) {
    if (avr_->cycle < pages_->busy_until())
      pass_cycles(std::min(cycle, pages_->busy_until()));
    else if (avr_->state == cpu_Running)
      run_instructions(cycle);
    else if (avr_->state == cpu_Sleeping)
      sleep(cycle);
    else if (!recover_from_crash())
      break;
    if (avr_->run != normal_run_) {  // the watchdog asks for a reset
      avr_->run(avr_);
      after_reset();
    }
  }
  if (is_dead()) avr_->cycle = std::max<std::uint64_t>(avr_->cycle, cycle);
}

void Mcu::run_instructions(std::uint64_t cycle) {
  // Writing to a timer makes simavr start its count of cycles afresh; a timer of ours at the end
  // stops it there all the same.
  const std::uint64_t left = cycle - avr_->cycle;
  avr_->run_cycle_limit = left;
  if (fence_ != cycle) {
    fence_ = cycle;
    avr_cycle_timer_register(
        avr_, left, [](avr_t*, avr_cycle_count_t, void*) { return avr_cycle_count_t{0}; }, this);
  }
  avr_->run_cycle_count = std::min<std::uint64_t>(avr_->run_cycle_count, left);
  const avr_flashaddr_t next_pc = avr_run_one(avr_);
  if (avr_->state == cpu_Crashed) return;
  avr_cycle_timer_process(avr_);
  avr_->pc = next_pc;
  if (avr_->interrupt_state != 0) avr_service_interrupts(avr_);
}

/// Time goes by, devices work, the processor does not.
void Mcu::pass_cycles(std::uint64_t cycle) {
  const std::uint64_t until_timer = avr_cycle_timer_process(avr_);
  const std::uint64_t left = cycle - avr_->cycle;
  avr_->cycle += std::clamp<std::uint64_t>(until_timer, 1, left);
}

void Mcu::sleep(std::uint64_t cycle) {
  const std::uint64_t until_timer = avr_cycle_timer_process(avr_);
  if (avr_->state == cpu_Running && !may_wake()) avr_->state = cpu_Sleeping;
  if (avr_->state == cpu_Sleeping) {
    const std::uint64_t cycles = std::clamp<std::uint64_t>(until_timer, 1, cycle - avr_->cycle);
    avr_->cycle += cycles;
    slept_cycles_ += cycles;
  } else if (avr_->interrupt_state != 0) {
    avr_service_interrupts(avr_);
  }
}

/// In power-down the clocks of the timers and of the comparator stand still in silicon; simavr lets
/// them run. So only what may wake the real one counts.
bool Mcu::may_wake() const {
  if ((avr_->data[reg::kSmcr] & reg::kSleepModeMask) != reg::kSleepPowerDown) return true;
  for (std::size_t vector = 1; vector < kVectors; ++vector) {
    const bool can_wake = vector <= reg::kVectorLastPinChange || vector == reg::kVectorWatchdog ||
                          vector == reg::kVectorTwi;
    if (can_wake && vectors_[vector] != nullptr && vectors_[vector]->pending) return true;
  }
  return false;
}

/// The program counter of the ATmega328P has 14 bits and wraps; simavr stops there instead. The
/// standard way into the bootloader, an indirect call to word 0x7000, relies on the wrap: it lands
/// at byte 0x6000 and runs through erased flash into byte 0x7000.
bool Mcu::recover_from_crash() {
  if (avr_->state == cpu_Crashed && avr_->pc >= kFlashMask) {
    avr_->pc &= kFlashMask;
    avr_->state = cpu_Running;
    return true;
  }
  char text[64];
  std::snprintf(text, sizeof text, "stopped in state %d at 0x%04x", avr_->state, avr_->pc);
  crash_ = text;
  return false;
}

void Mcu::after_reset() {
  ++resets_;
  avr_->run_cycle_limit = 1;
  pages_->reset();
  fence_ = 0;
  analog_->arm();
}

}  // namespace swarmtalk::emulator
