#include "loop/chance.hpp"

#include <sys/random.h>

#include <stdexcept>

namespace swarmtalk::loop {

std::uint32_t random_bits() {
  std::uint32_t bits = 0;
  if (getrandom(&bits, sizeof bits, 0) != sizeof bits) {
    throw std::runtime_error("the kernel gives no random numbers (getrandom)");
  }
  return bits;
}

}  // namespace swarmtalk::loop
