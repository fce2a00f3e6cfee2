// LogLine: one line that a robot said on the channel `debug`.
#pragma once

#include <cstdint>
#include <string>

#include "view/scene/swarm.hpp"

namespace swarmtalk::view {

struct LogLine {
  std::uint64_t number = 0;
  std::uint32_t robot = 0;
  std::string text;
  Time at{};
};

}  // namespace swarmtalk::view
