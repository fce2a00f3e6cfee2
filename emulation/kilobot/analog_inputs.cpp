#include "emulation/kilobot/analog_inputs.hpp"

#include <simavr/avr_acomp.h>
#include <simavr/avr_adc.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "emulation/kilobot/atmega328p.hpp"

namespace swarmtalk::emulator {

namespace reg = atmega328p;

namespace {

constexpr std::uint32_t kLitMillivolts = 1000, kDarkMillivolts = 0, kThresholdMillivolts = 500;
constexpr std::uint32_t kAmbientLightCounts = 300, kTemperatureCounts = 300;
constexpr unsigned kBatteryChannel = 6, kAmbientLightChannel = 7;
// How far a run may overshoot: the longest instruction, an interrupt, and a rounded cycle.
constexpr unsigned kOvershootCycles = 4 + reg::kInterruptEntryCycles + 1;

}  // namespace

AnalogInputs::AnalogInputs(avr_t* avr, const AnalogSettings& settings,
                           std::function<void(std::uint64_t)> on_rise)
    : avr_(avr), settings_(settings), on_rise_(std::move(on_rise)), noise_(settings.seed, 3) {
  const auto irq = [avr](std::uint32_t module, int index) {
    return avr_io_getirq(avr, module, index);
  };
  comparator_input_ = irq(AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_AIN0);
  avr_raise_irq(irq(AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_AIN1), kThresholdMillivolts);
  avr_irq_register_notify(irq(AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_OUT), on_state, this);
  avr_register_io_write(avr, reg::kAcsr, on_acsr_write, this);

  converter_trigger_ = irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_IN_TRIGGER);
  for (std::size_t channel = 0; channel < converter_inputs_.size(); ++channel) {
    converter_inputs_[channel] =
        irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + static_cast<int>(channel));
  }
  avr_raise_irq(converter_inputs_[kBatteryChannel], settings.battery_counts);
  avr_raise_irq(converter_inputs_[kAmbientLightChannel], kAmbientLightCounts);
  avr_raise_irq(irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_TEMP), kTemperatureCounts);
  avr_irq_register_notify(irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), on_conversion, this);

  for (int i = 0; i < avr->interrupts.vector_count; ++i) {
    avr_int_vector_t* vector = avr->interrupts.vector[i];
    if (vector->vector == reg::kVectorComparator) comparator_vector_ = vector;
  }
}

void AnalogInputs::push(const SignalEdge& edge) {
  if (edge.cycle + kOvershootCycles < avr_->cycle) ++late_edges_;
  const bool is_first = edge.cycle < front_end_.next_cycle();
  front_end_.push(edge);
  if (is_first) arm();
}

void AnalogInputs::arm() {
  const std::uint64_t next = front_end_.next_cycle();
  if (next == IrFrontEnd::kNever) return;
  avr_cycle_timer_register(avr_, next > avr_->cycle ? next - avr_->cycle : 1, on_timer, this);
}

std::uint64_t AnalogInputs::on_timer(avr_t* avr, std::uint64_t, void* self) {
  auto& inputs = *static_cast<AnalogInputs*>(self);
  const bool has_changed = inputs.front_end_.apply_until(avr->cycle);
  const bool is_lit = inputs.front_end_.is_lit();
  if (is_lit) inputs.show_strength();  // of one more sender, if it was lit before
  if (has_changed) {
    if (is_lit) inputs.on_rise_(avr->cycle);
    avr_raise_irq(inputs.comparator_input_, is_lit ? kLitMillivolts : kDarkMillivolts);
  }
  const std::uint64_t next = inputs.front_end_.next_cycle();
  // The comparator takes over its input one cycle later; two leave it time to.
  return next == IrFrontEnd::kNever ? 0 : std::max<std::uint64_t>(next, avr->cycle + 2);
}

void AnalogInputs::show_strength() {
  const auto noisy = [this](std::uint16_t counts) {
    if (settings_.noise_counts == 0) return static_cast<std::uint32_t>(counts);
    const int noise = static_cast<int>(noise_.normal() * settings_.noise_counts);
    return static_cast<std::uint32_t>(std::clamp(counts + noise, 0, kConverterMax));
  };
  avr_raise_irq(converter_inputs_[0], noisy(front_end_.peak().high_gain));
  avr_raise_irq(converter_inputs_[1], noisy(front_end_.peak().low_gain));
}

void AnalogInputs::on_state(avr_irq_t*, std::uint32_t value, void* self) {
  auto& inputs = *static_cast<AnalogInputs*>(self);
  inputs.comparator_is_high_ = value != 0;
  if (value != 0) inputs.begin_conversion();
}

/// If the comparator is what triggers it.
void AnalogInputs::begin_conversion() {
  const std::uint8_t* data = avr_->data;
  const std::uint8_t needed = reg::kAden | reg::kAdate;
  if ((data[reg::kAdcsra] & needed) == needed &&
      (data[reg::kAdcsrb] & reg::kAdtsMask) == reg::kAdtsComparator) {
    avr_raise_irq(converter_trigger_, 1);
  }
}

void AnalogInputs::on_acsr_write(avr_t* avr, std::uint16_t, std::uint8_t value, void* self) {
  auto& inputs = *static_cast<AnalogInputs*>(self);
  if ((value & reg::kAci) != 0) avr_clear_interrupt(avr, inputs.comparator_vector_);
  std::uint8_t& acsr = avr->data[reg::kAcsr];
  acsr = static_cast<std::uint8_t>(acsr & ~reg::kAco);
  if (inputs.comparator_is_high_) acsr |= reg::kAco;
}

void AnalogInputs::on_conversion(avr_irq_t*, std::uint32_t value, void* self) {
  auto& inputs = *static_cast<AnalogInputs*>(self);
  avr_adc_mux_t mux{};
  std::memcpy(&mux, &value, sizeof value);  // how simavr packs it
  if (mux.kind != ADC_MUX_SINGLE || mux.src != kBatteryChannel) return;
  // Programs take their random numbers from the lowest bits of the battery's voltage.
  avr_raise_irq(inputs.converter_inputs_[kBatteryChannel],
                inputs.settings_.battery_counts + inputs.noise_.below(8));
}

}  // namespace swarmtalk::emulator
