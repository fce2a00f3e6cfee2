// The smallest port there is, compiled and run by tests/unit/platforms: four functions join a robot
// to SwarmTalk, and every suite program runs on it unchanged. Copy it and fill in your robot's
// calls; docs/porting.md explains each step. This one's "radio" is a mailbox, its "motors" are
// numbers.
#pragma once

#include <stdint.h>
#include <string.h>

#include "platforms/robot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk {
namespace platforms {

/// What the robot's firmware offers, here as plain variables a test can look at.
struct ExampleHardware {
  uint32_t timer_ticks = 0;
  uint32_t noise = 1;
  Colour led = {0, 0, 0};
  int8_t left_motor = 0;
  int8_t right_motor = 0;
};

class ExampleRobot {
 public:
  using Profile = core::Kilobot;
  static constexpr uint16_t kBodyMm = 33;
  static constexpr uint16_t kSpeedMmPerS = 10;  // for programs that move
  static constexpr uint16_t kTurnDegPerS = 45;
  static constexpr uint32_t kTicksPerSecond = 31;

  explicit ExampleRobot(ExampleHardware& hardware)
      : hardware_(hardware), node_(core::Port{&read_clock, &draw, this}) {}

  // The four functions of a port: (1) the clock and (2) random numbers, which the node calls ...
  static uint32_t read_clock(void* self) {
    return static_cast<ExampleRobot*>(self)->hardware_.timer_ticks;
  }
  static uint32_t draw(void* self) {
    ExampleHardware& hardware = static_cast<ExampleRobot*>(self)->hardware_;
    hardware.noise = hardware.noise * UINT32_C(1664525) + UINT32_C(1013904223);
    return hardware.noise >> 8 ^ hardware.noise << 24;  // a generator's low bits are not random
  }
  // ... (3) what the driver calls when the radio can send, and (4) when it has received.
  uint16_t on_radio_ready(uint8_t* frame) { return node_.pull_packet(frame); }
  void on_radio_receive(const uint8_t* frame, uint16_t size, int16_t distance_mm) {
    node_.on_packet(frame, size, core::DistanceSensing{distance_mm});
  }

  // What programs see (platforms/robot.hpp).
  core::Swarmtalk<Profile>& swarmtalk() { return node_; }
  uint32_t clock() { return hardware_.timer_ticks; }
  uint32_t random() { return draw(this); }
  static int16_t distance(int32_t mm) { return static_cast<int16_t>(mm); }
  void led(Colour colour) { hardware_.led = colour; }
  void forward(uint32_t ticks) { move(1, 1, ticks); }
  void left(uint32_t ticks) { move(0, 1, ticks); }
  void right(uint32_t ticks) { move(1, 0, ticks); }
  void stop() { move(0, 0, 0); }
  bool is_moving() const { return hardware_.left_motor != 0 || hardware_.right_motor != 0; }
  void log(const char*, int32_t) {}

  /// Call it in the main loop: ends timed moves.
  void poll() {
    if (moves_for_ != 0 && hardware_.timer_ticks - moves_since_ >= moves_for_) stop();
  }

 private:
  void move(int8_t left_motor, int8_t right_motor, uint32_t ticks) {
    hardware_.left_motor = left_motor;
    hardware_.right_motor = right_motor;
    moves_since_ = hardware_.timer_ticks;
    moves_for_ = ticks;
  }

  ExampleHardware& hardware_;
  core::Swarmtalk<Profile> node_;
  uint32_t moves_since_ = 0;
  uint32_t moves_for_ = 0;
};

}  // namespace platforms
}  // namespace swarmtalk
