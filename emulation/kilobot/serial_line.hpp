// SerialLine: the serial port of an emulated ATmega328P as silicon has it, where simavr's differs:
// 10 bits a byte (simavr counts a parity bit), and no room for more than three bytes that the
// program has not read. Used by Mcu.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

struct avr_t;
struct avr_irq_t;
struct avr_uart_t;

namespace swarmtalk::emulator {

class SerialLine {
 public:
  /// @param avr  initialised; outlives it. @param on_byte  called for each byte that is sent
  SerialLine(avr_t* avr, std::function<void(std::uint8_t)> on_byte);
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;

  /// A byte comes in, its start bit now. With three unread it is lost.
  void push(std::uint8_t byte);
  std::uint64_t bytes_lost() const { return bytes_lost_; }

 private:
  static void on_baud_write(avr_t* avr, std::uint16_t, std::uint8_t, void* self);
  static void on_output(avr_irq_t*, std::uint32_t value, void* self);

  std::function<void(std::uint8_t)> on_byte_;
  avr_uart_t* uart_ = nullptr;
  avr_irq_t* input_ = nullptr;
  std::uint64_t bytes_lost_ = 0;
};

}  // namespace swarmtalk::emulator
