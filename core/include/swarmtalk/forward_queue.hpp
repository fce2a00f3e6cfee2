// Packets of other nodes, waiting to be sent on, in order of arrival: the places of the packets are
// a list, and what leaves from its middle moves places, not packets. Owned by the node, one per
// node, for all channels. Suppressing copies is the DuplicateCache's work; the queue only lets a
// better copy (more TTL left) improve the one that still waits.
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

/// How often the first packet is still to be repeated, where packets are repeated.
template <uint8_t kRepeats>
class RepeatsLeft {
 protected:
  bool repeat() {
    const bool again = left_ != 0;
    left_ = again ? static_cast<uint8_t>(left_ - 1) : kRepeats;
    return again;
  }
  void begin_repeats() { left_ = kRepeats; }
  uint8_t left_;
};
template <>
class RepeatsLeft<0> {
 protected:
  bool repeat() { return false; }
  void begin_repeats() {}
};

template <class P>
class ForwardQueue : private RepeatsLeft<P::kForwardRepeats> {
 public:
  using W = Wire<P>;
  using Header = typename W::Header;
  using Ticks = typename W::WaitTicks;
  using PacketSize = typename W::PacketSize;
  using Slot = UintFor<bits_for(P::kForwardSlots)>;

  enum class Pushed : uint8_t {
    kDone,
    kForAnother,  // an older packet was dropped for it
    kFull,        // it was dropped
  };

  SWARMTALK_PART(ForwardQueue)
  SWARMTALK_AVR_CALLED void start() {
    set_zero(count_);
    this->begin_repeats();
    for (Slot n = 0; n != P::kForwardSlots; ++n) order_[n] = n;
  }

  void clear() {
    count_ = 0;
    this->begin_repeats();
  }
  bool is_empty() const { return count_ == 0; }
  Slot size() const { return count_; }

  /// Queues a copy of `packet` (`size` bytes, checked, TTL > 0), one hop further.
  /// Where message numbers are small, few messages of one sender on one channel may wait, and the
  /// oldest gives way to the newest: what waits for long would be sent on when its number stands
  /// for another message.
  Pushed push(const uint8_t* packet, PacketSize size, const Header& header, Ticks now) {
    Pushed pushed = Pushed::kDone;
    if (kFewWait && drop_oldest_of_many(packet, header.message)) {
      pushed = Pushed::kForAnother;
    }
    if (count_ == P::kForwardSlots) return Pushed::kFull;
    Queued& queued = slot(count_++);
    const PacketSize bare = P::kPadded ? W::kMtuBytes - W::kChecksumBytes
                                       : static_cast<PacketSize>(size - W::kChecksumBytes);
    memcpy(queued.packet, packet, bare);
    queued.set_size(bare);
    queued.since = now;
    W::count_hop(queued.packet, header);
    return pushed;
  }

  /// If a copy of the header's packet waits with less TTL than this one would get, raises it.
  /// Cost: a look at each waiting packet; only copies of something heard before pay it.
  /// @param packet  with `header`, TTL > 0
  SWARMTALK_AVR_CALLED void improve(const uint8_t* packet, const Header& header) {
    const Slot* place = order_;
    for (Slot left = count_; left != 0; --left) {
      uint8_t* const waiting = in_register(slots_[*place++].packet);
      if (!W::is_same_packet(waiting, packet)) continue;
      if (static_cast<uint8_t>(header.ttl - 1) > W::ttl(waiting)) {
        W::set_hops(waiting, header.hops);
        W::count_hop(waiting, header);
      }
      return;
    }
  }

  /// The packet that pull() gives next. REQUIRES !is_empty().
  const uint8_t* next() { return slot(0).packet; }

  /// Bytes that pull() gives next. REQUIRES !is_empty().
  PacketSize next_bytes() const {
    return static_cast<PacketSize>(slots_[order_[0]].size(W::kMtuBytes - W::kChecksumBytes) +
                                   W::kChecksumBytes);
  }

  /// Takes out what has waited for longer than `limit`. @return how many
  Slot drop_older_than(Ticks limit, Ticks now) {
    Slot dropped = 0;
    for (; count_ != 0 && static_cast<Ticks>(now - slot(0).since) > limit; ++dropped) {
      this->begin_repeats();
      drop(0);
    }
    return dropped;
  }

  /// Takes out the packet that waits longest, and repeats it kForwardRepeats times.
  /// @param timestamped  its timestamp gets the time it waited here, if it has room for one (it may
  ///                     have come before its channel was opened with timestamps)
  /// @return bytes written to `out` (W::kMtuBytes at most)
  PacketSize pull(bool timestamped, Ticks now, uint8_t* out) {
    Queued& queued = slot(0);
    const PacketSize bare = static_cast<PacketSize>(queued.size(W::kMtuBytes - W::kChecksumBytes));
    memcpy(out, queued.packet, bare);
    if (timestamped && bare >= W::kHeaderBytes + W::kTimestampBytes) {
      const Ticks waited = static_cast<Ticks>(now - queued.since);
      W::set_timestamp(out, bare, W::later(W::timestamp(out, bare), waited));
    }
    if (!this->repeat()) drop(0);
    return W::seal(out, bare);
  }

 private:
  struct Queued : QueuedSize<!P::kPadded> {
    uint8_t packet[W::kMtuBytes - W::kChecksumBytes];
    Ticks since;
  };
  static constexpr bool kFewWait = P::kMessageBits < 16;
  static constexpr uint16_t kMostWaiting =
      static_cast<uint16_t>(W::kMessageMask < 8 ? 1 : W::kMessageMask / 4u);
  /// Takes out the first packet that waits of this one's sender and channel, if messages of theirs
  /// wait that are as many as a quarter of the numbers.
  /// @param last  number of the packet's message
  SWARMTALK_AVR_CALLED bool drop_oldest_of_many(const uint8_t* packet,
                                                typename W::MessageNumber last) {
    Slot oldest = 0;
    Slot messages = 0;
    const Slot* place = order_;
    for (Slot left = count_; left != 0; --left) {
      const uint8_t* const waiting = in_register(slots_[*place++].packet);
      if (!W::is_same_stream(waiting, packet)) continue;
      const auto number = W::MessageField::get(waiting);
      if (number == last) continue;
      last = number;
      if (messages++ == 0) oldest = static_cast<Slot>(count_ - left);
    }
    if (messages < kMostWaiting) return false;
    if (oldest == 0) this->begin_repeats();
    drop(oldest);
    return true;
  }
  /// Takes out the nth packet that waits: those behind it move up.
  SWARMTALK_AVR_CALLED void drop(Slot n) {
    Slot* place = &order_[n];
    const Slot freed = *place;
    --count_;
    for (Slot left = static_cast<Slot>(count_ - n); left != 0; --left) {
      place[0] = place[1];
      ++place;
    }
    *place = freed;
  }
  /// The nth packet that waits; n may be their count: the next free place.
  SWARMTALK_AVR_CALLED Queued& slot(Slot n) { return slots_[order_[n]]; }

  Queued slots_[P::kForwardSlots];
  Slot order_[P::kForwardSlots];  // all places: those of the packets that wait, the first one first
  Slot count_;
};

}  // namespace core
}  // namespace swarmtalk
