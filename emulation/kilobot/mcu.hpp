// Mcu: one emulated ATmega328P, a thin wrapper around a simavr instance. Runs it to an exact cycle,
// and closes the gaps that simavr 1.6 has for Kilobot images through simavr's public hooks (list in
// mcu_gaps.cpp and docs/kilobot-emulator.md). Knows nothing of time, other nodes or the air.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "emulation/kilobot/analog_inputs.hpp"
#include "emulation/kilobot/eeprom.hpp"
#include "emulation/kilobot/flash_pages.hpp"
#include "emulation/kilobot/image.hpp"
#include "emulation/kilobot/quiet_ports.hpp"
#include "emulation/kilobot/serial_line.hpp"
#include "emulation/kilobot/skip_repair.hpp"

struct avr_t;
struct avr_int_vector_t;

namespace swarmtalk::emulator {

struct Pin {
  char port = 'B';
  std::uint8_t bit = 0;
};

struct McuSettings {
  std::uint32_t clock_hz = 8'000'000;
  Pin infrared_led;  // its switching is reported
  AnalogSettings analog;
  bool resets_to_bootloader = false;  // fuse BOOTRST: a reset begins at kBootloaderStart
};

class Mcu {
 public:
  static constexpr std::size_t kVectors = 26;

  /// @param image  must outlive the Mcu (its symbols are looked up, its flash is copied)
  Mcu(const Image& image, const Eeprom& eeprom, const McuSettings& settings);
  ~Mcu();
  Mcu(const Mcu&) = delete;
  Mcu& operator=(const Mcu&) = delete;

  /// Executes up to a cycle; ends at most one instruction and one interrupt entry (8 cycles) later.
  void run_until(std::uint64_t cycle);
  std::uint64_t cycle() const;

  /// Adds a light edge at the receiver, at a cycle that has not been executed yet.
  void push_light(const SignalEdge& edge) { analog_->push(edge); }

  /// One byte on the serial line, its start bit now. Does what the hardware does when the program
  /// has not read the bytes before: two wait, a third in the shift register, more are lost.
  void push_serial_byte(std::uint8_t byte) { serial_->push(byte); }

  /// The charger's signal at PD0: low while it is at work. It is not, from power-on.
  void set_charging(bool is_charging);

  std::uint8_t data(std::uint16_t address) const;
  std::uint32_t program_counter() const;
  std::vector<std::uint8_t> flash() const;  // kFlashBytes
  Eeprom eeprom() const;

  bool is_dead() const { return !crash_.empty(); }
  const std::string& crash() const { return crash_; }  // why it stopped; empty while it runs

  std::uint64_t late_edges() const { return analog_->late_edges(); }
  std::uint64_t serial_bytes_lost() const { return serial_->bytes_lost(); }
  std::uint32_t resets() const { return resets_; }
  std::uint32_t pages_written() const { return pages_->written(); }
  std::uint64_t slept_cycles() const { return slept_cycles_; }
  /// Longest run of an interrupt's handler so far, from entry to return, in cycles.
  std::uint32_t longest_handler_cycles(std::size_t vector) const { return longest_[vector]; }
  /// Fewest bytes that were ever free between the program's variables and its stack; nothing if
  /// the image says not where its variables end.
  std::optional<unsigned> stack_free_bytes() const;

  std::function<void(std::uint64_t cycle, bool is_on)> on_infrared;
  std::function<void(std::uint64_t cycle)> on_comparator_rise;
  std::function<void(std::uint8_t byte)> on_serial_byte;

 private:
  struct Hooks;  // simavr's callbacks, mcu_gaps.cpp
  void install_hooks();
  void after_reset();
  void run_instructions(std::uint64_t cycle);
  void sleep(std::uint64_t cycle);
  void pass_cycles(std::uint64_t cycle);
  bool recover_from_crash();
  bool may_wake() const;

  const Image& image_;
  McuSettings settings_;
  avr_t* avr_ = nullptr;
  void (*normal_run_)(avr_t*) = nullptr;
  std::array<avr_int_vector_t*, kVectors> vectors_{};

  SkipRepair skip_repair_;
  std::optional<AnalogInputs> analog_;
  std::optional<QuietPorts> ports_;
  std::optional<SerialLine> serial_;
  std::optional<FlashPages> pages_;
  std::uint64_t fence_ = 0;  // cycle at which simavr is told to stop
  std::string crash_;
  std::uint32_t resets_ = 0;
  std::uint64_t slept_cycles_ = 0;
  std::array<std::uint64_t, kVectors> entered_{};
  std::array<std::uint32_t, kVectors> longest_{};
};

}  // namespace swarmtalk::emulator
