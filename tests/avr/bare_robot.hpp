// A robot with nothing on it but a clock and a lamp register: what is left of an image with it,
// less the same image without a program, is the library.
#pragma once

#include <avr/io.h>

#include "platforms/robot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {

class BareRobot {
 public:
  using Profile = core::Kilobot;
  static constexpr uint16_t kBodyMm = 33;
  static constexpr uint32_t kTicksPerSecond = 31;

  BareRobot() : node_(core::Port{&read_clock, &read_random, nullptr}) {}
  core::Swarmtalk<Profile>& swarmtalk() { return node_; }
  uint32_t clock() { return read_clock(nullptr); }
  uint32_t random() { return read_random(nullptr); }
  static int16_t distance(int32_t mm) { return static_cast<int16_t>(mm); }
  void log(const char*, int32_t) {}
  void led(platforms::Colour colour) { PORTC = static_cast<uint8_t>(colour.red | colour.green); }

 private:
  static uint32_t read_clock(void*) { return static_cast<uint32_t>(GPIOR0) << 8 | TCNT0; }
  static uint32_t read_random(void*) { return static_cast<uint32_t>(ADCL) << 3 | TCNT0; }
  core::Swarmtalk<Profile> node_;
};

}  // namespace swarmtalk
