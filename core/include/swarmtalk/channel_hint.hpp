// Where a channel probably is, by the low bits of its number: found without a search. Owned by the
// node, in profiles that take the usual path first; empty in the others.
#pragma once

#include <stdint.h>

#include "swarmtalk/channel.hpp"

namespace swarmtalk {
namespace core {

template <class P, bool kPresent>
class ChannelHint {
 protected:
  using ChannelId = typename Wire<P>::ChannelId;
  static constexpr uint8_t kHints = 16;
  /// The number alone tells the channel: no two share a place.
  static constexpr bool kIsSure = (UINT32_C(1) << P::kChannelBits) <= kHints;

  /// A channel whose number has the same low bits, or null.
  Channel<P>* hinted(ChannelId id) const { return hints_[kIsSure ? id : id % kHints]; }
  void hint(ChannelId id, Channel<P>* channel) { hints_[id % kHints] = channel; }
  void forget(const Channel<P>* channel) {
    for (Channel<P>*& hinted : hints_) {
      if (hinted == channel) hinted = nullptr;
    }
  }

 private:
  Channel<P>* hints_[kHints] = {};
};

template <class P>
class ChannelHint<P, false> {
 protected:
  static constexpr bool kIsSure = false;
  Channel<P>* hinted(typename Wire<P>::ChannelId) const { return nullptr; }
  void hint(typename Wire<P>::ChannelId, Channel<P>*) {}
  void forget(const Channel<P>*) {}
};

}  // namespace core
}  // namespace swarmtalk
