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

#include "emulation/kilobot/eeprom.hpp"
#include "emulation/kilobot/flash_pages.hpp"
#include "emulation/kilobot/image.hpp"
#include "emulation/kilobot/ir_front_end.hpp"
#include "emulation/kilobot/quiet_ports.hpp"
#include "emulation/kilobot/random.hpp"
#include "emulation/kilobot/serial_line.hpp"
#include "emulation/kilobot/skip_repair.hpp"

struct avr_t;
struct avr_irq_t;
struct avr_int_vector_t;

namespace swarmtalk::emulator {

struct Pin {
  char port = 'B';
  std::uint8_t bit = 0;
};

struct McuSettings {
  std::uint32_t clock_hz = 8'000'000;
  Pin infrared_led;                    // its switching is reported
  int converter_noise_counts = 0;      // standard deviation of a converted signal strength
  std::uint16_t battery_counts = 700;  // what the converter shows for the battery
  std::uint64_t seed = 1;              // for converter noise
  bool resets_to_bootloader = false;   // fuse BOOTRST: a reset begins at kBootloaderStart
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

  /// Adds a light edge at the receiver, at a cycle that has not been executed yet. One that comes
  /// later than run_until()'s own inaccuracy explains takes effect at once and is counted.
  void push_light(const SignalEdge& edge);

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

  std::uint64_t late_edges() const { return late_edges_; }
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
  void arm_light_timer();
  void show_strength();
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
  avr_irq_t* comparator_input_ = nullptr;
  avr_irq_t* converter_trigger_ = nullptr;
  std::array<avr_irq_t*, 8> converter_inputs_{};
  avr_int_vector_t* comparator_vector_ = nullptr;
  std::array<avr_int_vector_t*, kVectors> vectors_{};

  IrFrontEnd front_end_;
  SkipRepair skip_repair_;
  Random noise_;
  bool comparator_is_high_ = false;
  std::optional<QuietPorts> ports_;
  std::optional<SerialLine> serial_;
  std::optional<FlashPages> pages_;
  std::uint64_t fence_ = 0;  // cycle at which simavr is told to stop
  std::string crash_;
  std::uint64_t late_edges_ = 0;
  std::uint32_t resets_ = 0;
  std::uint64_t slept_cycles_ = 0;
  std::array<std::uint64_t, kVectors> entered_{};
  std::array<std::uint32_t, kVectors> longest_{};
};

}  // namespace swarmtalk::emulator
