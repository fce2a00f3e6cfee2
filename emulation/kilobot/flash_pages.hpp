// FlashPages: what erasing and writing a page of an emulated ATmega328P's flash does in silicon and
// not in simavr: it takes time, in which the processor stands still, and writing clears bits and
// sets none. Used by Mcu.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

struct avr_t;

namespace swarmtalk::emulator {

class FlashPages {
 public:
  /// @param avr  initialised; outlives it. @param on_change  called when a page has changed
  FlashPages(avr_t* avr, std::function<void()> on_change);
  FlashPages(const FlashPages&) = delete;
  FlashPages& operator=(const FlashPages&) = delete;

  /// Until this cycle the processor stands still.
  std::uint64_t busy_until() const { return busy_until_; }
  void reset() { busy_until_ = 0; }
  std::uint32_t written() const { return written_; }

 private:
  static void on_control_write(avr_t* avr, std::uint16_t, std::uint8_t value, void* self);
  static std::uint64_t on_begin(avr_t* avr, std::uint64_t, void* self);

  std::function<void()> on_change_;
  std::vector<std::uint8_t> before_write_;  // of all flash; empty while no page is being written
  std::uint64_t busy_until_ = 0;            // cycle
  std::uint32_t written_ = 0;
};

}  // namespace swarmtalk::emulator
