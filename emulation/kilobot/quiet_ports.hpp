// QuietPorts: writes to the ports of an emulated ATmega328P that change nothing go no further.
// Programs tend to write to their ports what is there already; simavr would look at every pin.
// Used by Mcu.
#pragma once

#include <array>
#include <cstdint>

struct avr_t;

namespace swarmtalk::emulator {

class QuietPorts {
 public:
  /// @param avr  initialised; does not run after this is gone
  explicit QuietPorts(avr_t* avr);
  QuietPorts(const QuietPorts&) = delete;
  QuietPorts& operator=(const QuietPorts&) = delete;

 private:
  /// simavr's handler of writes to a port.
  struct Behind {
    void (*write)(avr_t*, std::uint16_t, std::uint8_t, void*) = nullptr;
    void* param = nullptr;
  };
  static void on_write(avr_t* avr, std::uint16_t address, std::uint8_t value, void* behind);

  std::array<Behind, 6> behind_{};
};

}  // namespace swarmtalk::emulator
