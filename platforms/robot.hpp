// The robot that a suite program sees: a class with these members, one per platform. There is no
// base class and nothing virtual; a program is a template over Robot, and a platform is joined with
// it at compile time (docs/porting.md). C++14, so that the same program runs on a Kilobot.
//
//   class SomeRobot {
//     using Profile = ...;                        // wire format, swarmtalk/profiles/
//     static constexpr uint16_t kBodyMm = 33;     // body diameter
//     core::Swarmtalk<Profile>& swarmtalk();      // its node
//     uint32_t clock();                           // ticks, wrapping
//     static constexpr uint32_t kTicksPerSecond;  // of that clock
//     uint32_t random();                          // uniform bits
//     static Distance distance(int32_t mm);       // in the unit of the profile's sensing
//     void led(Colour colour);
//     void forward(uint32_t ticks);               // moves for that long, then stops; 0: until told
//     void left(uint32_t ticks);                  // turns
//     void right(uint32_t ticks);
//     void stop();
//     bool is_moving();
//     void log(const char* text, int32_t number); // for people; may do nothing
//   };
//
// The owner calls the program's setup() once and loop() over and over, on the same thread as the
// node (or with interrupts off around the node's calls).
#pragma once

#include <stdint.h>

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {
namespace platforms {

/// Light of a robot's LED, 0 to 255 each; a platform with less shows the nearest it can.
struct Colour {
  uint8_t red;
  uint8_t green;
  uint8_t blue;
};

constexpr Colour kOff = {0, 0, 0};
constexpr Colour kRed = {255, 0, 0};
constexpr Colour kGreen = {0, 255, 0};
constexpr Colour kBlue = {0, 0, 255};
constexpr Colour kYellow = {255, 255, 0};
constexpr Colour kWhite = {255, 255, 255};

/// Programs give lengths in Kilobot millimetres; a robot k times as wide sees them k times as long.
constexpr uint16_t kKilobotBodyMm = 33;

/// A length of `kilobot_mm` on this robot, in millimetres.
template <class Robot>
constexpr int32_t scaled_mm(int32_t kilobot_mm) {
  return kilobot_mm * Robot::kBodyMm / kKilobotBodyMm;
}

}  // namespace platforms
}  // namespace swarmtalk
