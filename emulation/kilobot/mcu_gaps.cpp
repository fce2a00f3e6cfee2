// What simavr 1.6 lacks for Kilobot images, added through its public hooks:
//  - the converter's trigger by the comparator (ADTS = 1), by which the signal strength is
//  measured;
//  - "write one to clear" of the comparator's flag, and its read-only output bit;
//  - interrupt vectors in the bootloader section (IVSEL), and four cycles of interrupt entry;
//  - erasing and writing flash pages (flash_pages.hpp), and the serial line (serial_line.hpp);
//  - phase-correct PWM of the 8-bit timers, which drives the motors;
//  - skips over "adiw" and "sbiw" (skip_repair.hpp).
// Also here: the polling of INT0 and INT1, low by design, that would cost two thirds of all speed;
// quiet_ports.hpp spares some more.
#include <simavr/avr_acomp.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_interrupts.h>

#include <algorithm>
#include <cstring>

#include "emulation/kilobot/atmega328p.hpp"
#include "emulation/kilobot/mcu.hpp"

namespace swarmtalk::emulator {

namespace reg = atmega328p;

namespace {

constexpr std::uint32_t kLitMillivolts = 1000, kDarkMillivolts = 0, kThresholdMillivolts = 500;
constexpr unsigned kInterruptEntryCycles = 4;
// How far run_until() may overshoot: the longest instruction, an interrupt, and a rounded cycle.
constexpr unsigned kOvershootCycles = 4 + kInterruptEntryCycles + 1;
constexpr unsigned kBatteryChannel = 6;

/// Phase-correct PWM counts up and down, 510 steps; simavr does not know it for the two small
/// timers and lets them overflow with every count, which is wrong and slow. 512 steps up come
/// close.
void add_phase_correct_pwm(avr_t* avr) {
  constexpr unsigned kMode = 1;
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next) {
    auto* timer = reinterpret_cast<avr_timer_t*>(io);
    if (std::strcmp(io->kind, "timer") != 0 || (timer->name != '0' && timer->name != '2')) continue;
    timer->wgm_op[kMode].kind = avr_timer_wgm_fc_pwm;
    timer->wgm_op[kMode].size = 9;  // bits
  }
}

}  // namespace

struct Mcu::Hooks {
  static Mcu& self(void* param) { return *static_cast<Mcu*>(param); }

  /// simavr's messages say nothing that the emulator does not know better, but for one: an invalid
  /// instruction may be one of ours.
  static void logger(avr_t* avr, int level, const char*, va_list) {
    if (level == LOG_ERROR && avr != nullptr && avr->custom.data != nullptr)
      self(avr->custom.data).skip_repair_.execute(avr);
  }

  static avr_cycle_count_t light_timer(avr_t* avr, avr_cycle_count_t, void* param) {
    Mcu& mcu = self(param);
    const bool has_changed = mcu.front_end_.apply_until(avr->cycle);
    if (has_changed) {
      const bool is_lit = mcu.front_end_.is_lit();
      if (is_lit) {
        mcu.show_strength();
        if (mcu.on_comparator_rise) mcu.on_comparator_rise(avr->cycle);
      }
      avr_raise_irq(mcu.comparator_input_, is_lit ? kLitMillivolts : kDarkMillivolts);
    } else if (mcu.front_end_.is_lit()) {
      mcu.show_strength();  // one more sender shines
    }
    const std::uint64_t next = mcu.front_end_.next_cycle();
    // The comparator takes over its input one cycle later; two leave it time to.
    return next == IrFrontEnd::kNever ? 0 : std::max<std::uint64_t>(next, avr->cycle + 2);
  }

  static void comparator_output(avr_irq_t*, std::uint32_t value, void* param) {
    Mcu& mcu = self(param);
    const std::uint8_t* data = mcu.avr_->data;
    const std::uint8_t needed = reg::kAden | reg::kAdate;
    if (value != 0 && (data[reg::kAdcsra] & needed) == needed &&
        (data[reg::kAdcsrb] & reg::kAdtsMask) == reg::kAdtsComparator)
      avr_raise_irq(mcu.converter_trigger_, 1);
  }

  static void acsr_write(avr_t* avr, avr_io_addr_t, std::uint8_t value, void* param) {
    Mcu& mcu = self(param);
    if ((value & reg::kAci) != 0) avr_clear_interrupt(avr, mcu.comparator_vector_);
    std::uint8_t& acsr = avr->data[reg::kAcsr];
    acsr = static_cast<std::uint8_t>(acsr & ~reg::kAco);
    if (mcu.comparator_is_high_) acsr |= reg::kAco;
  }

  static void comparator_state(avr_irq_t*, std::uint32_t value, void* param) {
    self(param).comparator_is_high_ = value != 0;
  }

  static void conversion_starts(avr_irq_t*, std::uint32_t value, void* param) {
    Mcu& mcu = self(param);
    avr_adc_mux_t mux{};
    std::memcpy(&mux, &value, sizeof value);  // how simavr packs it
    // Programs take their random numbers from the lowest bits of the battery's voltage.
    if (mux.kind == ADC_MUX_SINGLE && mux.src == kBatteryChannel)
      avr_raise_irq(mcu.converter_inputs_[kBatteryChannel],
                    mcu.settings_.battery_counts + mcu.noise_.below(8));
  }

  static void vector_running(avr_irq_t* irq, std::uint32_t value, void* param) {
    Mcu& mcu = self(param);
    avr_t* avr = mcu.avr_;
    const std::size_t vector = (irq->irq >> 8) % kVectors;
    if (value != 0) {
      avr->cycle += kInterruptEntryCycles;
      mcu.entered_[vector] = avr->cycle;
      if ((avr->data[reg::kMcucr] & reg::kIvsel) != 0) avr->pc += kBootloaderStart;
    } else if (mcu.entered_[vector] != 0) {
      const auto cycles = static_cast<std::uint32_t>(avr->cycle - mcu.entered_[vector]);
      mcu.longest_[vector] = std::max(mcu.longest_[vector], cycles);
      mcu.entered_[vector] = 0;
    }
  }

  static void infrared_pin(avr_irq_t*, std::uint32_t value, void* param) {
    Mcu& mcu = self(param);
    if (mcu.on_infrared) mcu.on_infrared(mcu.avr_->cycle, (value & 1) != 0);
  }
};

void Mcu::install_hooks() {
  avr_->custom.data = this;
  avr_global_logger_set(Hooks::logger);
  const auto irq = [this](std::uint32_t module, int index) {
    return avr_io_getirq(avr_, module, index);
  };
  avr_extint_set_strict_lvl_trig(avr_, 0, 0);
  avr_extint_set_strict_lvl_trig(avr_, 1, 0);
  add_phase_correct_pwm(avr_);

  comparator_input_ = irq(AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_AIN0);
  avr_raise_irq(irq(AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_AIN1), kThresholdMillivolts);
  avr_irq_t* output = irq(AVR_IOCTL_ACOMP_GETIRQ, ACOMP_IRQ_OUT);
  avr_irq_register_notify(output, Hooks::comparator_state, this);
  avr_irq_register_notify(output, Hooks::comparator_output, this);
  avr_register_io_write(avr_, reg::kAcsr, Hooks::acsr_write, this);

  converter_trigger_ = irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_IN_TRIGGER);
  for (int channel = 0; channel < 8; ++channel)
    converter_inputs_[static_cast<std::size_t>(channel)] =
        irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + channel);
  avr_raise_irq(converter_inputs_[kBatteryChannel], settings_.battery_counts);
  avr_raise_irq(converter_inputs_[7], 300);  // ambient light
  avr_raise_irq(irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_TEMP), 300);
  avr_irq_register_notify(irq(AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), Hooks::conversion_starts,
                          this);

  for (int i = 0; i < avr_->interrupts.vector_count; ++i) {
    avr_int_vector_t* vector = avr_->interrupts.vector[i];
    if (vector->vector < kVectors) vectors_[vector->vector] = vector;
    avr_irq_register_notify(vector->irq + AVR_INT_IRQ_RUNNING, Hooks::vector_running, this);
  }
  comparator_vector_ = vectors_[reg::kVectorComparator];
  pages_.emplace(avr_, [this] { skip_repair_.scan(avr_); });

  avr_irq_register_notify(
      irq(static_cast<std::uint32_t>(AVR_IOCTL_IOPORT_GETIRQ(settings_.infrared_led.port)),
          settings_.infrared_led.bit),
      Hooks::infrared_pin, this);
  set_charging(false);

  ports_.emplace(avr_);
  serial_.emplace(avr_, [this](std::uint8_t byte) {
    if (on_serial_byte) on_serial_byte(byte);
  });
}

void Mcu::show_strength() {
  const auto noisy = [this](std::uint16_t counts) {
    if (settings_.converter_noise_counts == 0) return static_cast<std::uint32_t>(counts);
    const int noise = static_cast<int>(noise_.normal() * settings_.converter_noise_counts);
    return static_cast<std::uint32_t>(std::clamp(counts + noise, 0, kConverterMax));
  };
  avr_raise_irq(converter_inputs_[0], noisy(front_end_.peak().high_gain));
  avr_raise_irq(converter_inputs_[1], noisy(front_end_.peak().low_gain));
}

void Mcu::arm_light_timer() {
  const std::uint64_t next = front_end_.next_cycle();
  if (next == IrFrontEnd::kNever) return;
  avr_cycle_timer_register(avr_, next > avr_->cycle ? next - avr_->cycle : 1, Hooks::light_timer,
                           this);
}

void Mcu::push_light(const SignalEdge& edge) {
  if (edge.cycle + kOvershootCycles < avr_->cycle) ++late_edges_;
  const bool is_first = edge.cycle < front_end_.next_cycle();
  front_end_.push(edge);
  if (is_first) arm_light_timer();
}

void Mcu::set_charging(bool is_charging) {
  constexpr int kPinCharging = 0;
  // Stronger than the processor's own pull-up.
  avr_ioport_external_t external{};
  external.name = 'D';
  external.mask = 1 << kPinCharging;
  external.value = is_charging ? 0 : 1 << kPinCharging;
  avr_ioctl(avr_, static_cast<std::uint32_t>(AVR_IOCTL_IOPORT_SET_EXTERNAL('D')), &external);
  avr_raise_irq(
      avr_io_getirq(avr_, static_cast<std::uint32_t>(AVR_IOCTL_IOPORT_GETIRQ('D')), kPinCharging),
      is_charging ? 0 : 1);
}

}  // namespace swarmtalk::emulator
