// What the judge tells a robot's program to do: one call in one infrared message, and where the
// answer is. Two images understand it, one on our hardware layer and one on kilolib, so that both
// do the same thing and their pins can be compared. C++14, for AVR and host.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace judge {

constexpr uint8_t kCallType = 0x11;  // of the infrared message: data[0] call, data[1..8] arguments

enum class Call : uint8_t {
  kNothing,
  kSetMotors,      // left, right
  kTurnLeft,       // as the program of a calibrated robot does it, with its push
  kTurnRight,      // dito
  kStraight,       // dito
  kStop,           // dito
  kSetColour,      // red, green, blue: 0 to 3
  kLight,          // answers with the reading
  kBattery,        // dito
  kTemperature,    // dito
  kDistance,       // high and low gain, little-endian; answers with mm
  kUid,            // answers with it
  kTurnLeftDuty,   // answers with the robot's calibration
  kTurnRightDuty,  // dito
  kStraightLeft,   // dito
  kStraightRight,  // dito
  kTicks,          // answers with the low 16 bits of the clock
  kSend,           // sends one message of type data[1]
};

}  // namespace judge
}  // namespace swarmtalk

// What the emulator looks at in an image.
extern volatile uint8_t probe_done;     // calls that are finished, wraps
extern volatile uint16_t probe_answer;  // of the last one
extern volatile uint16_t probe_high;    // strength of the last message, at high and low gain
extern volatile uint16_t probe_low;
