// Course: what one run of a virtual swarm has done, as a number: every frame with its time, and
// every line of the daemons' log. Two runs of one seed have the same, whatever compiled them.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace swarmtalk::test {

class Course {
 public:
  void add(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) value_ = (value_ ^ byte) * 0x100000001b3;  // FNV-1a
  }
  void add(std::string_view text) {
    add({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  }
  void add(std::uint64_t number) {
    for (int shift = 0; shift < 64; shift += 8) {
      value_ = (value_ ^ (number >> shift & 0xFF)) * 0x100000001b3;
    }
  }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 0xcbf29ce484222325;
};

}  // namespace swarmtalk::test
