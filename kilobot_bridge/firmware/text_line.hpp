// A gateway report as a line for people and simple scripts, with the same calls as GatewayFrame:
// kind, sequence and the payload's fields in hexadecimal with a blank before each, 16-bit numbers
// high byte first. A message 01..09 of type 0, low gain 612, high gain 845, 48 mm away:
//
//   01 07 0120 01 02 03 04 05 06 07 08 09 00 0264 034d 30
#pragma once

#include <stdint.h>

#include "kilobot_wire/gateway_frame.hpp"

namespace swarmtalk {
namespace kilobot_bridge {

class TextLine {
 public:
  void begin(GatewayKind kind, uint8_t sequence) {
    size_ = 0;
    put_hex(static_cast<uint8_t>(kind));
    append(sequence);
  }

  void append(uint8_t byte) {
    put(' ');
    put_hex(byte);
  }
  /// A number as people read it: the high byte first.
  void append16(uint16_t number) {
    put(' ');
    put_hex(static_cast<uint8_t>(number >> 8));
    put_hex(static_cast<uint8_t>(number));
  }

  void end() {
    put('\r');
    put('\n');
  }

  uint8_t size() const { return size_; }
  uint8_t byte(uint8_t index) const { return static_cast<uint8_t>(bytes_[index]); }

 private:
  static constexpr uint8_t kLineBytes = 80;

  void put(char character) {
    if (size_ < kLineBytes) bytes_[size_++] = character;
  }
  void put_digit(uint8_t digit) {
    put(static_cast<char>(digit < 10 ? '0' + digit : 'a' + digit - 10));
  }
  void put_hex(uint8_t byte) {
    put_digit(byte >> 4);
    put_digit(byte & 15);
  }

  char bytes_[kLineBytes];
  uint8_t size_ = 0;
};

}  // namespace kilobot_bridge
}  // namespace swarmtalk
