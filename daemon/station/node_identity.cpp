#include "daemon/station/node_identity.hpp"

#include "loop/chance.hpp"

namespace swarmtalk::daemon {

NodeIdentity::NodeIdentity(std::optional<std::uint16_t> fixed, NodeIdRange range)
    : NodeIdentity(fixed, range, loop::random_bits()) {}

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
    id_ = static_cast<std::uint16_t>(range_.least + loop::random_bits() % count);
  } while (id_ == old && count > 1);
  previous_ = old;
}

}  // namespace swarmtalk::daemon
