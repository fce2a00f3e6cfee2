// Which of several sources may send next: each that is ready gets its turn before any gets a second
// one. Owned by the node; source 0 is the forward queue, the others are the channels.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

/// A set of numbers below kSize, one bit each. Large ones are kept in words as wide as the machine
/// counts at once.
template <uint16_t kSize>
class BitSet {
 public:
  static constexpr bool kIsWide = sizeof(void*) == 8;

  SWARMTALK_PART(BitSet)
  void start() { set_zero(groups_); }
  void set(uint16_t i, bool value) {
    const Group bit = one_bit<Group>(i % kGroupBits);
    Group& group = groups_[group_of(i)];
    group = static_cast<Group>(value ? group | bit : group & ~bit);
  }
  bool has(uint16_t i) const {
    return (groups_[group_of(i)] & one_bit<Group>(i % kGroupBits)) != 0;
  }
  bool is_empty() const {
    for (uint8_t n = 0; n < kGroups; ++n) {
      if (groups_[n] != 0) return false;
    }
    return true;
  }
  /// Whether 0 is in it, and no other.
  bool is_first_alone() const { return kGroups == 1 && groups_[0] == 1; }
  /// Whether i begins a group of which none is in the set.
  bool is_empty_group(uint16_t i) const {
    return kGroups > 1 && i % kGroupBits == 0 && groups_[i / kGroupBits] == 0 &&
           i + unsigned{kGroupBits} <= kSize;
  }
  /// The lowest in the set that is not below `from`; kSize: none.
  uint16_t first_from(uint16_t from) const {
    for (uint16_t i = from; i < kSize;
         i = static_cast<uint16_t>((i / kGroupBits + 1) * kGroupBits)) {
      const Group rest = static_cast<Group>(groups_[i / kGroupBits] >> i % kGroupBits);
      if (rest != 0) return static_cast<uint16_t>(i + __builtin_ctzll(rest));
    }
    return kSize;
  }

 private:
  using Group = UintFor<kIsWide ? 64 : 8>;
  static constexpr uint8_t kGroupBits = sizeof(Group) * 8;
  static constexpr uint8_t kGroups = (kSize + kGroupBits - 1) / kGroupBits;
  static uint16_t group_of(uint16_t i) {
    return static_cast<uint16_t>(kGroups == 1 ? 0 : i / kGroupBits);
  }
  Group groups_[kGroups];
};

/// Cost of next(): a look at each group at most, where they are wide; else kSources / 8 steps over
/// empty ones and eight more.
template <uint16_t kSources>
class RoundRobin {
 public:
  using Source = UintFor<bits_for(kSources)>;
  static constexpr Source kNone = kSources;

  SWARMTALK_PART(RoundRobin)
  void start() { last_ = kSources - 1; }

  SWARMTALK_AVR_CALLED void set_ready(Source source, bool is_ready) {
    ready_.set(source, is_ready);
  }
  bool is_any_ready() const { return !ready_.is_empty(); }

  /// The next ready source after the last one given, which becomes the last. kNone: none is ready.
  Source next() {
    if (BitSet<kSources>::kIsWide) {
      if (ready_.is_first_alone()) return last_ = 0;
      const Source found = peek();
      if (found != kNone) last_ = found;
      return found;
    }
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
    if (BitSet<kSources>::kIsWide) {
      const uint16_t found = ready_.first_from(static_cast<uint16_t>(last_ + 1u));
      return static_cast<Source>(found != kSources ? found : ready_.first_from(0));
    }
    RoundRobin copy = *this;
    return copy.next();
  }

 private:
  BitSet<kSources> ready_;
  Source last_;
};

}  // namespace core
}  // namespace swarmtalk
