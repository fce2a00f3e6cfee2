#include "daemon/station/node_identity.hpp"

#include <sys/random.h>

#include <stdexcept>

namespace swarmtalk::daemon {

std::uint32_t random_bits() {
  std::uint32_t bits = 0;
  if (getrandom(&bits, sizeof bits, 0) != sizeof bits) {
    throw std::runtime_error("the kernel gives no random numbers (getrandom)");
  }
  return bits;
}

NodeIdentity::NodeIdentity(std::optional<std::uint16_t> fixed, NodeIdRange range)
    : NodeIdentity(fixed, range, random_bits()) {}

NodeIdentity::NodeIdentity(std::optional<std::uint16_t> fixed, NodeIdRange range,
                           std::uint32_t epoch)
    : range_(range), is_fixed_(fixed.has_value()), epoch_(epoch) {
  if (fixed)
    id_ = *fixed;
  else
    draw_again();
}

void NodeIdentity::set(std::optional<std::uint16_t> fixed) {
  const bool was_fixed = is_fixed_;
  is_fixed_ = fixed.has_value();
  const std::uint16_t old = id_;
  if (fixed)
    id_ = *fixed;
  else if (was_fixed)
    draw_again();
  if (id_ != old) previous_ = old;
}

void NodeIdentity::draw_again() {
  const std::uint16_t old = id_;
  const std::uint32_t count = range_.most - range_.least + 1u;
  do {
    id_ = static_cast<std::uint16_t>(range_.least + random_bits() % count);
  } while (id_ == old && count > 1);
  previous_ = old;
}

}  // namespace swarmtalk::daemon
