// NodeIdentity: under which id this robot speaks, on all its links alike, and the epoch that tells
// this start of the daemon from others. A configured id never changes; an automatic one is random
// and is drawn again when somebody else is heard under it (Zhang et al., AAMAS 2020, sec. 2.1).
#pragma once

#include <cstdint>
#include <optional>

namespace swarmtalk::daemon {

/// Random bits from the kernel. @throws std::runtime_error
std::uint32_t random_bits();

class NodeIdentity {
 public:
  /// @param fixed  1..65534; none: automatic
  explicit NodeIdentity(std::optional<std::uint16_t> fixed);

  std::uint16_t id() const { return id_; }
  bool is_fixed() const { return is_fixed_; }
  std::uint32_t epoch() const { return epoch_; }

  /// Another id than now, 1..65534. @pre not fixed
  void draw_again();

 private:
  std::uint16_t id_ = 0;
  bool is_fixed_;
  std::uint32_t epoch_;
};

}  // namespace swarmtalk::daemon
