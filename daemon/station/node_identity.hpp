// NodeIdentity: under which id this robot speaks, and the epoch that tells this start of the daemon
// from others. One for the daemon; a link whose packets have no room for that id has its own. A
// configured id never changes; an automatic one is random and is drawn again when somebody else is
// heard under it (Zhang et al., AAMAS 2020, sec. 2.1).
#pragma once

#include <cstdint>
#include <optional>

namespace swarmtalk::daemon {

struct NodeIdRange {
  std::uint16_t least = 1;
  std::uint16_t most = 65534;
};

class NodeIdentity {
 public:
  /// @param fixed  within `range`; none: automatic
  explicit NodeIdentity(std::optional<std::uint16_t> fixed, NodeIdRange range = {});

  /// Another id of the same daemon: the same epoch.
  NodeIdentity(std::optional<std::uint16_t> fixed, NodeIdRange range, std::uint32_t epoch);

  std::uint16_t id() const { return id_; }
  bool is_fixed() const { return is_fixed_; }
  /// Whether it is our id, or was before the last change: frames may still be on their way back.
  bool was(std::uint16_t id) const { return id == id_ || (id == previous_ && id != 0); }
  std::uint32_t epoch() const { return epoch_; }

  /// From now on this id, within the range; none: automatic, and drawn at once if it was fixed.
  void set(std::optional<std::uint16_t> fixed);

  /// Another id than now, within the range. @pre not fixed
  void draw_again();

 private:
  NodeIdRange range_;
  std::uint16_t id_ = 0;
  std::uint16_t previous_ = 0;  // 0: none
  bool is_fixed_;
  std::uint32_t epoch_;
};

}  // namespace swarmtalk::daemon
