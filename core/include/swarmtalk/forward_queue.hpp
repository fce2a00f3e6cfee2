// Packets of other nodes, waiting to be sent on: a ring in order of arrival. Owned by the node, one
// per node, for all channels. Suppressing copies is the DuplicateCache's work; the queue only lets
// a better copy (more TTL left) improve the one that still waits.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// Length of a queued packet, where packets have lengths.
template <bool kPresent>
struct QueuedSize {
  uint16_t size_;
  void set_size(uint16_t size) { size_ = size; }
  uint16_t size(uint16_t) const { return size_; }
};
template <>
struct QueuedSize<false> {
  void set_size(uint16_t) {}
  uint16_t size(uint16_t full) const { return full; }
};

template <class P>
class ForwardQueue {
 public:
  using W = Wire<P>;
  using Header = typename W::Header;
  using Ticks = UintFor<P::kClockBits>;
  using Slot = UintFor<bits_for(P::kForwardSlots)>;

  ForwardQueue() : first_(0), count_(0), repeats_left_(P::kForwardRepeats) {}

  bool is_empty() const { return count_ == 0; }
  Slot size() const { return count_; }

  /// Queues a copy of `packet` (`size` bytes, checked, TTL > 0), one hop further.
  /// @return false if no slot is free
  bool push(const uint8_t* packet, uint16_t size, const Header& header, Ticks now) {
    if (count_ == P::kForwardSlots) return false;
    Queued& queued = slots_[wrap(first_ + count_)];
    ++count_;
    const uint16_t bare = static_cast<uint16_t>(size - W::kChecksumBytes);
    memcpy(queued.packet, packet, bare);
    queued.set_size(bare);
    queued.since = now;
    W::count_hop(queued.packet, header);
    return true;
  }

  /// If a copy of the header's packet waits with less TTL than this one would get, raises it.
  /// Cost: a look at each waiting packet; only copies of something heard before pay it.
  void improve(const Header& header) {
    if (header.ttl == 0) return;
    for (Slot n = 0; n < count_; ++n) {
      uint8_t* packet = slots_[wrap(first_ + n)].packet;
      const Header waiting = W::decode(packet);
      if (!W::is_same_packet(waiting, header)) continue;
      if (header.ttl - 1 > waiting.ttl) {
        W::set_hops(packet, header.hops);
        W::count_hop(packet, header);
      }
      return;
    }
  }

  /// Header of the packet that pull() gives next. REQUIRES !is_empty().
  Header next() const { return W::decode(slots_[first_].packet); }

  /// Takes out the packet that waits longest, and repeats it kForwardRepeats times.
  /// @param timestamped  its timestamp gets the time it waited here
  /// @return bytes written to `out` (W::kMtuBytes at most)
  uint16_t pull(bool timestamped, Ticks now, uint8_t* out) {
    Queued& queued = slots_[first_];
    const uint16_t bare = queued.size(W::kMtuBytes - W::kChecksumBytes);
    memcpy(out, queued.packet, bare);
    if (timestamped) {
      const Ticks waited = static_cast<Ticks>(now - queued.since);
      W::set_timestamp(out, bare, W::later(W::timestamp(out, bare), waited));
    }
    if (P::kForwardRepeats == 0 || repeats_left_ == 0) {
      first_ = wrap(first_ + 1u);
      --count_;
      repeats_left_ = P::kForwardRepeats;
    } else {
      --repeats_left_;
    }
    return W::seal(out, bare);
  }

 private:
  struct Queued : QueuedSize<!P::kPadded> {
    uint8_t packet[W::kMtuBytes - W::kChecksumBytes];
    Ticks since;
  };
  static Slot wrap(uint16_t slot) {
    return static_cast<Slot>(slot >= P::kForwardSlots ? slot - P::kForwardSlots : slot);
  }

  Queued slots_[P::kForwardSlots];
  Slot first_;
  Slot count_;
  uint8_t repeats_left_;
};

}  // namespace core
}  // namespace swarmtalk
