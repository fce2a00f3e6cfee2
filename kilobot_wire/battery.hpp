// A Kilobot's battery as its converter shows it (of 1023), and the colours that stand for it: above
// kBatteryFull green, above kBatteryGood blue, above kBatteryLow yellow, else red. Portable, C++14:
// the robots' firmware shows them, hosts name them.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot {

constexpr int16_t kBatteryFull = 682;
constexpr int16_t kBatteryGood = 648;
constexpr int16_t kBatteryLow = 614;

}  // namespace kilobot
}  // namespace swarmtalk
