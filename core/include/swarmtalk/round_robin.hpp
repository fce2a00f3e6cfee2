// Which of several sources may send next: each that is ready gets its turn before any gets a second
// one. Owned by the node; source 0 is the forward queue, the others are the channels.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

/// Cost of next(): kSources / 8 steps over empty groups at most.
template <uint16_t kSources>
class RoundRobin {
 public:
  using Source = UintFor<bits_for(kSources)>;
  static constexpr Source kNone = kSources;

  RoundRobin() : last_(kSources - 1) { memset(ready_, 0, sizeof(ready_)); }

  void set_ready(Source source, bool is_ready) {
    const uint8_t bit = static_cast<uint8_t>(1u << (source % 8));
    uint8_t& group = ready_[source / 8];
    group = static_cast<uint8_t>(is_ready ? group | bit : group & ~bit);
  }
  bool is_ready(Source source) const { return (ready_[source / 8] >> (source % 8) & 1) != 0; }

  bool is_any_ready() const {
    for (uint8_t group = 0; group < kGroups; ++group) {
      if (ready_[group] != 0) return true;
    }
    return false;
  }

  /// The next ready source after the last one given, which becomes the last. kNone: none is ready.
  Source next() {
    Source source = last_;
    for (uint16_t n = 0; n < kSources; ++n) {
      ++source;
      if (source >= kSources) source = 0;
      if (kGroups > 1 && source % 8 == 0 && ready_[source / 8] == 0 && source + 8u <= kSources) {
        source = static_cast<Source>(source + 7u);
        n = static_cast<uint16_t>(n + 7u);
        continue;
      }
      if (is_ready(source)) {
        last_ = source;
        return source;
      }
    }
    return is_ready(last_) ? last_ : kNone;
  }

 private:
  static constexpr uint8_t kGroups = (kSources + 7) / 8;
  uint8_t ready_[kGroups];
  Source last_;
};

}  // namespace core
}  // namespace swarmtalk
