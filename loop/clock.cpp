#include "loop/clock.hpp"

namespace swarmtalk::loop {

std::chrono::steady_clock::time_point now() {
  return std::chrono::steady_clock::now();
}

std::chrono::system_clock::time_point wall_now() {
  return std::chrono::system_clock::now();
}

}  // namespace swarmtalk::loop
