// What simavr 1.6 lacks for Kilobot images, added through its public hooks:
//  - how comparator and converter work together (analog_inputs.hpp);
//  - interrupt vectors in the bootloader section (IVSEL), and four cycles of interrupt entry;
//  - erasing and writing flash pages (flash_pages.hpp), and the serial line (serial_line.hpp);
//  - phase-correct PWM of the 8-bit timers, which drives the motors;
//  - skips over "adiw" and "sbiw" (skip_repair.hpp).
// Also here: the polling of INT0 and INT1, low by design, that would cost two thirds of all speed;
// quiet_ports.hpp spares some more.
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

  static void vector_running(avr_irq_t* irq, std::uint32_t value, void* param) {
    Mcu& mcu = self(param);
    avr_t* avr = mcu.avr_;
    const std::size_t vector = (irq->irq >> 8) % kVectors;
    if (value != 0) {
      avr->cycle += reg::kInterruptEntryCycles;
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

  analog_.emplace(avr_, settings_.analog, [this](std::uint64_t cycle) {
    if (on_comparator_rise) on_comparator_rise(cycle);
  });
  for (int i = 0; i < avr_->interrupts.vector_count; ++i) {
    avr_int_vector_t* vector = avr_->interrupts.vector[i];
    if (vector->vector < kVectors) vectors_[vector->vector] = vector;
    avr_irq_register_notify(vector->irq + AVR_INT_IRQ_RUNNING, Hooks::vector_running, this);
  }
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
