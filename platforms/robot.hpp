// The robot that a suite program sees: a class with these members, one per platform. There is no
// base class and nothing virtual; a program is a template over Robot, and a platform is joined with
// it at compile time (docs/porting.md). C++14, so that the same program runs on a Kilobot.
//
//   class SomeRobot {
//     using Profile = ...;                        // wire format, swarmtalk/profiles/
//     static constexpr uint16_t kBodyMm = 33;     // body diameter
//     static constexpr uint16_t kSpeedMmPerS = 10;  // ahead; only for programs that move
//     static constexpr uint16_t kTurnDegPerS = 45;  // left and right; the same
//     core::Swarmtalk<Profile>& swarmtalk();      // its node, or what has its new_channel()
//     uint32_t clock();                           // ticks, wrapping
//     static constexpr uint32_t kTicksPerSecond;  // of that clock: 31, a Kilobot's
//     uint32_t random();                          // uniform bits
//     static Distance distance(int32_t mm);       // in the unit of the profile's sensing
//     void led(Colour colour);
//     void forward(uint32_t ticks);               // moves for that long, then stops; 0: until told
//     void left(uint32_t ticks);                  // turns
//     void right(uint32_t ticks);
//     void stop();
//     bool is_moving();
//     void log(const char* name, int32_t number); // a value to record; may do nothing
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

/// Programs give times as numbers of ticks, and messages come as often as these expect.
/// Compiles only if Robot's clock fits; says in a sentence what is wrong otherwise.
template <class Robot>
struct CheckedRobot {
  static_assert(Robot::kTicksPerSecond >= 25 && Robot::kTicksPerSecond <= 40,
                "programs count time in a Kilobot's ticks of 32.768 ms: let clock() count those");
  static constexpr bool kIsSound = true;
};

/// Programs give lengths in Kilobot millimetres; a robot k times as wide sees them k times as long.
constexpr uint16_t kKilobotBodyMm = 33;

/// A length of `kilobot_mm` on this robot, in millimetres.
template <class Robot>
constexpr int32_t scaled_mm(int32_t kilobot_mm) {
  return kilobot_mm * Robot::kBodyMm / kKilobotBodyMm;
}

/// Ticks in which this robot moves `kilobot_mm` ahead, at least one.
template <class Robot>
constexpr uint16_t forward_ticks(int32_t kilobot_mm) {
  return static_cast<uint16_t>(1 + scaled_mm<Robot>(kilobot_mm) *
                                       static_cast<int32_t>(Robot::kTicksPerSecond) /
                                       Robot::kSpeedMmPerS);
}

/// Ticks in which it turns by `degrees`, at least one.
template <class Robot>
constexpr uint16_t turn_ticks(int32_t degrees) {
  return static_cast<uint16_t>(1 + degrees * static_cast<int32_t>(Robot::kTicksPerSecond) /
                                       Robot::kTurnDegPerS);
}

template <class T>
T& any();  // for decltype only

/// What new_publisher() returns: the core's where the node is in the program, a proxy's where a
/// daemon has it.
template <class Robot>
using PublisherPointer =
    decltype(any<Robot>()
                 .swarmtalk()
                 .new_channel(0, 0, false)
                 ->new_publisher(static_cast<core::SentFn>(nullptr), static_cast<void*>(nullptr)));

}  // namespace platforms
}  // namespace swarmtalk
