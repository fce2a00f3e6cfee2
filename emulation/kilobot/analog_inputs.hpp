// AnalogInputs: comparator and converter of an emulated ATmega328P as silicon has them, where
// simavr 1.6 has them otherwise: the converter's trigger by the comparator (ADTS = 1), by which the
// strength of a signal is measured, "write one to clear" of the comparator's flag, and its
// read-only output bit. They see the light at the robot's receiver, and its battery. Used by Mcu.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "emulation/kilobot/ir_front_end.hpp"
#include "emulation/kilobot/random.hpp"

struct avr_t;
struct avr_irq_t;
struct avr_int_vector_t;

namespace swarmtalk::emulator {

struct AnalogSettings {
  int noise_counts = 0;                // standard deviation of a converted signal strength
  std::uint16_t battery_counts = 700;  // what the converter shows for the battery
  std::uint64_t seed = 1;              // for the noise
};

class AnalogInputs {
 public:
  /// @param avr  initialised; outlives it. @param on_rise  called when the comparator sees light
  AnalogInputs(avr_t* avr, const AnalogSettings& settings,
               std::function<void(std::uint64_t cycle)> on_rise);
  AnalogInputs(const AnalogInputs&) = delete;
  AnalogInputs& operator=(const AnalogInputs&) = delete;

  /// Adds a light edge, at a cycle that has not been executed yet. One that comes later than the
  /// inaccuracy of the processor's runs explains takes effect at once and is counted.
  void push(const SignalEdge& edge);
  std::uint64_t late_edges() const { return late_edges_; }

  /// The processor has been reset, and forgotten what was to happen when.
  void arm();

 private:
  static std::uint64_t on_timer(avr_t* avr, std::uint64_t, void* self);
  static void on_state(avr_irq_t*, std::uint32_t value, void* self);
  static void on_acsr_write(avr_t* avr, std::uint16_t, std::uint8_t value, void* self);
  static void on_conversion(avr_irq_t*, std::uint32_t value, void* self);
  void show_strength();
  void begin_conversion();

  avr_t* avr_;
  AnalogSettings settings_;
  std::function<void(std::uint64_t)> on_rise_;
  IrFrontEnd front_end_;
  Random noise_;
  avr_irq_t* comparator_input_ = nullptr;
  avr_irq_t* converter_trigger_ = nullptr;
  std::array<avr_irq_t*, 8> converter_inputs_{};
  avr_int_vector_t* comparator_vector_ = nullptr;
  bool comparator_is_high_ = false;
  std::uint64_t late_edges_ = 0;
};

}  // namespace swarmtalk::emulator
