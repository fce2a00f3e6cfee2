// Which of several sources may send next: each that is ready gets its turn before any gets a second
// one. Owned by the node; source 0 is the forward queue, the others are the channels.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

/// A set of numbers below kSize, one bit each.
template <uint16_t kSize>
class BitSet {
 public:
  BitSet() { memset(groups_, 0, sizeof(groups_)); }
  void set(uint16_t i, bool value) {
    const uint8_t bit = one_bit<uint8_t>(i % 8);
    uint8_t& group = groups_[group_of(i)];
    group = static_cast<uint8_t>(value ? group | bit : group & ~bit);
  }
  bool has(uint16_t i) const { return (groups_[group_of(i)] & one_bit<uint8_t>(i % 8)) != 0; }
  bool is_empty() const {
    for (uint8_t n = 0; n < kGroups; ++n) {
      if (groups_[n] != 0) return false;
    }
    return true;
  }
  /// Whether i begins a group of eight of which none is in the set.
  bool is_empty_group(uint16_t i) const {
    return kGroups > 1 && i % 8 == 0 && groups_[i / 8] == 0 && i + 8u <= kSize;
  }

 private:
  static constexpr uint8_t kGroups = (kSize + 7) / 8;
  static uint16_t group_of(uint16_t i) { return kGroups == 1 ? 0 : i / 8; }
  uint8_t groups_[kGroups];
};

/// Cost of next(): kSources / 8 steps over empty groups at most.
template <uint16_t kSources>
class RoundRobin {
 public:
  using Source = UintFor<bits_for(kSources)>;
  static constexpr Source kNone = kSources;

  RoundRobin() : last_(kSources - 1) {}

  void set_ready(Source source, bool is_ready) { ready_.set(source, is_ready); }
  bool is_any_ready() const { return !ready_.is_empty(); }

  /// The next ready source after the last one given, which becomes the last. kNone: none is ready.
  Source next() {
    using Steps = UintFor<bits_for(kSources + UINT32_C(8))>;
    Source source = last_;
    for (Steps n = 0; n < kSources; ++n) {
      ++source;
      if (source >= kSources) source = 0;
      if (ready_.is_empty_group(source)) {
        source = static_cast<Source>(source + 7u);
        n = static_cast<Steps>(n + 7u);
      } else if (ready_.has(source)) {
        last_ = source;
        return source;
      }
    }
    return kNone;
  }

  /// What next() would give.
  Source peek() const {
    RoundRobin copy = *this;
    return copy.next();
  }

 private:
  BitSet<kSources> ready_;
  Source last_;
};

}  // namespace core
}  // namespace swarmtalk
