// How much redundancy a program asks for its messages: a number of repair packets, or that many as
// the loss around demands.
#pragma once

#include <cstdint>

namespace swarmtalk::daemon {

inline constexpr std::uint8_t kMostRedundancy = 12;
inline constexpr std::uint8_t kAutoRedundancy = 255;

}  // namespace swarmtalk::daemon
