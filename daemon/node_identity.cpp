#include "daemon/node_identity.hpp"

#include <sys/random.h>

#include <stdexcept>

#include "daemon/config.hpp"

namespace swarmtalk::daemon {

std::uint32_t random_bits() {
  std::uint32_t bits = 0;
  if (getrandom(&bits, sizeof bits, 0) != sizeof bits) {
    throw std::runtime_error("the kernel gives no random numbers (getrandom)");
  }
  return bits;
}

NodeIdentity::NodeIdentity(std::optional<std::uint16_t> fixed)
    : is_fixed_(fixed.has_value()), epoch_(random_bits()) {
  if (fixed)
    id_ = *fixed;
  else
    draw_again();
}

void NodeIdentity::draw_again() {
  const std::uint16_t old = id_;
  do {
    id_ = static_cast<std::uint16_t>(1 + random_bits() % kNodeIdLimits.most);
  } while (id_ == old);
}

}  // namespace swarmtalk::daemon
