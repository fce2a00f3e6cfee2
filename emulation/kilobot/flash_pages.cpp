#include "emulation/kilobot/flash_pages.hpp"

#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>

#include <utility>

#include "emulation/kilobot/atmega328p.hpp"
#include "emulation/kilobot/image.hpp"

namespace swarmtalk::emulator {

namespace reg = atmega328p;

namespace {

constexpr std::uint64_t kOperationUs = 4500;  // erase or write, data sheet table 27-2: 3.7..4.5
constexpr std::uint64_t kBeginsCycles = 8;

}  // namespace

FlashPages::FlashPages(avr_t* avr, std::function<void()> on_change)
    : on_change_(std::move(on_change)) {
  avr_register_io_write(avr, reg::kSpmcsr, on_control_write, this);
}

void FlashPages::on_control_write(avr_t* avr, std::uint16_t, std::uint8_t value, void* self) {
  if ((value & reg::kSelfprgen) == 0 || (value & (reg::kPgers | reg::kPgwrt)) == 0) return;
  auto& pages = *static_cast<FlashPages*>(self);
  if ((value & reg::kPgwrt) != 0) {
    ++pages.written_;
    pages.before_write_.assign(avr->flash, avr->flash + kFlashBytes);
  }
  // The instruction that starts the operation must follow within four cycles.
  avr_cycle_timer_register(avr, kBeginsCycles, on_begin, self);
}

std::uint64_t FlashPages::on_begin(avr_t* avr, std::uint64_t, void* self) {
  auto& pages = *static_cast<FlashPages*>(self);
  for (std::size_t i = 0; i < pages.before_write_.size(); ++i)
    avr->flash[i] &= pages.before_write_[i];
  pages.before_write_.clear();
  pages.busy_until_ = avr->cycle + kOperationUs * avr->frequency / 1'000'000;
  pages.on_change_();
  return 0;
}

}  // namespace swarmtalk::emulator
