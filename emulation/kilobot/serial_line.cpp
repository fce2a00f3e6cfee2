#include "emulation/kilobot/serial_line.hpp"

#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>

#include <cstring>

#include "emulation/kilobot/atmega328p.hpp"

namespace swarmtalk::emulator {

namespace reg = atmega328p;

namespace {

constexpr std::size_t kBufferBytes = 3;  // two in the buffer, one in the shift register
constexpr unsigned kBitsPerByte = 10;    // start, eight data, stop

avr_io_t* find_module(avr_t* avr, const char* kind) {
  for (avr_io_t* io = avr->io_port; io != nullptr; io = io->next)
    if (std::strcmp(io->kind, kind) == 0) return io;
  return nullptr;
}

}  // namespace

SerialLine::SerialLine(avr_t* avr, std::function<void(std::uint8_t)> on_byte)
    : on_byte_(std::move(on_byte)),
      uart_(reinterpret_cast<avr_uart_t*>(find_module(avr, "uart"))),
      input_(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT)) {
  uart_->flags = 0;
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT),
                          on_output, this);
  avr_register_io_write(avr, reg::kUbrr0l, on_baud_write, this);
}

void SerialLine::push(std::uint8_t byte) {
  const unsigned waiting = (uart_->input.write - uart_->input.read) & (64 - 1);
  if (waiting >= kBufferBytes) {
    ++bytes_lost_;
    return;
  }
  avr_raise_irq(input_, byte);
}

void SerialLine::on_baud_write(avr_t* avr, std::uint16_t, std::uint8_t, void* self) {
  const std::uint8_t* data = avr->data;
  const unsigned divider = data[reg::kUbrr0l] + ((data[reg::kUbrr0h] & 0xFu) << 8) + 1;
  const unsigned cycles_per_bit = divider * ((data[reg::kUcsr0a] & reg::kU2x) != 0 ? 8 : 16);
  static_cast<SerialLine*>(self)->uart_->cycles_per_byte = cycles_per_bit * kBitsPerByte;
}

void SerialLine::on_output(avr_irq_t*, std::uint32_t value, void* self) {
  static_cast<SerialLine*>(self)->on_byte_(static_cast<std::uint8_t>(value));
}

}  // namespace swarmtalk::emulator
