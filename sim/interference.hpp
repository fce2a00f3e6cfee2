// Interference: what keeps packets from arriving for a while: lines that nothing crosses, and
// jammers. Of the faults of a World those that have begun.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/world_config.hpp"

namespace swarmtalk::sim {

class Interference {
 public:
  /// @return whether the fault is one of this kind; it holds until its end_us
  bool begin(const Fault& fault) {
    if (fault.kind != Fault::Kind::kPartition && fault.kind != Fault::Kind::kJam) return false;
    active_.push_back(fault);
    return true;
  }

  /// Ends all faults of this kind.
  void end(Fault::Kind kind) {
    std::erase_if(active_, [kind](const Fault& fault) { return fault.kind == kind; });
  }

  const std::vector<Fault>& active() const { return active_; }

  /// Whether a line lies between the two.
  bool parts(const Body& a, const Body& b, uint64_t now_us) const {
    for (const Fault& fault : active_) {
      if (fault.kind != Fault::Kind::kPartition || now_us >= fault.end_us) continue;
      if ((a.x_mm < fault.x_mm) != (b.x_mm < fault.x_mm)) return true;
    }
    return false;
  }

  bool jams(const Body& body, uint64_t now_us) const {
    for (const Fault& fault : active_) {
      if (fault.kind != Fault::Kind::kJam || now_us >= fault.end_us) continue;
      const double dx = body.x_mm - fault.x_mm;
      const double dy = body.y_mm - fault.y_mm;
      if (dx * dx + dy * dy <= fault.radius_mm * fault.radius_mm) return true;
    }
    return false;
  }

 private:
  std::vector<Fault> active_;
};

}  // namespace swarmtalk::sim
