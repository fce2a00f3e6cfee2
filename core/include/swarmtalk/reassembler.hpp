// Puts messages together from their packets, which may come in any order. Owned by the node. Holds
// one pool of fragments for all channels; a message's fragments are a list under the index of its
// record in the DuplicateCache. The packet that completes a message is never stored.
//
// Cost per packet: the length of its own message at most, whatever else is held.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// One packet's share of a message, as the node has checked it.
template <class P>
struct Fragment {
  typename Wire<P>::PacketIndex sequence;
  typename Wire<P>::PacketIndex packets;  // of the whole message; 0 while unknown
  const uint8_t* payload;
  typename Wire<P>::PacketSize payload_bytes;
  typename Wire<P>::PacketSize payload_max;     // bytes in each packet but the last
  typename Wire<P>::MessageSize message_bytes;  // of the whole message, if the wire tells
  bool timestamped;
  typename Wire<P>::Timestamp delay;  // ticks spent before it came here
};

/// What is known of a message's length where packets have their exact length: the message's size
/// where each packet tells it, else the bytes of its last packet.
template <bool kPresent>
struct KnownLength {
  uint16_t length_;
  void set_length(uint16_t bytes) { length_ = bytes; }
  uint16_t length() const { return length_; }
};
template <>
struct KnownLength<false> {
  void set_length(uint16_t) {}
  uint16_t length() const { return 0; }
};

template <class P>
class Reassembler {
 public:
  using W = Wire<P>;
  using Mask = typename W::PacketMask;
  using Timestamp = typename W::Timestamp;
  using Ticks = typename W::Ticks;
  using PacketIndex = typename W::PacketIndex;
  using PacketSize = typename W::PacketSize;
  using Index = UintFor<bits_for(P::kRecords)>;
  using Slot = UintFor<bits_for(P::kFragmentSlots) + 1>;  // a bit is left for kEnds
  static constexpr Slot kNoSlot = P::kFragmentSlots;

  enum class Outcome : uint8_t {
    kHeld,           // stored; more is to come
    kComplete,       // with this packet: call take()
    kDuplicate,      // this packet is held already
    kContradiction,  // this packet cannot be of the message that is held
    kNoSlot,         // no fragment slot: make room and try again, or release()
  };

  Reassembler() : used_(0), free_(kNoSlot) {}

  /// Begins message `i`, nothing held.
  void begin(Index i) {
    assemblies_[i].held = 0;
    assemblies_[i].first = kNoSlot;
  }

  /// Adds a packet to message `i`, which has been begun. @param elapsed ticks since its last packet
  SWARMTALK_HOT Outcome add(Index i, const Fragment<P>& fragment, Ticks elapsed) {
    Assembly& assembly = assemblies_[i];
    const Mask bit = static_cast<Mask>(static_cast<Mask>(1) << fragment.sequence);
    if (contradicts(assembly, fragment, bit)) return Outcome::kContradiction;
    if ((assembly.held & bit) != 0) {
      return is_held_equal(assembly, fragment) ? Outcome::kDuplicate : Outcome::kContradiction;
    }
    const PacketIndex packets = packets_of(assembly, fragment);
    const Mask held = static_cast<Mask>(assembly.held | bit);
    if (packets != 0 && held == full(packets)) return Outcome::kComplete;
    if (free_ == kNoSlot && used_ == P::kFragmentSlots) return Outcome::kNoSlot;
    const Timestamp delay = delay_now(assembly, fragment, elapsed);
    insert(assembly, fragment);
    if (fragment.timestamped) {
      W::set_timestamp(slots_[head(assembly)].body, W::kBodyBytes, delay);
    }
    assembly.held = held;
    if (P::kSizeBits != 0) assembly.set_length(fragment.message_bytes);
    if (fragment.packets == fragment.sequence + 1u) {
      assembly.first = static_cast<Slot>(assembly.first | kEnds);
      if (P::kSizeBits == 0) assembly.set_length(fragment.payload_bytes);
    }
    return Outcome::kHeld;
  }

  /// The message that `last` completed (add() answered kComplete), written to `message`
  /// (W::kMessageBytes). Its fragments are released.
  /// @return bytes of the message; `delay` gets the largest delay of its packets until now
  uint16_t take(Index i, const Fragment<P>& last, Ticks elapsed, uint8_t* message,
                Timestamp* delay) {
    Assembly& assembly = assemblies_[i];
    *delay = delay_now(assembly, last, elapsed);
    const PacketIndex final_sequence = static_cast<PacketIndex>(packets_of(assembly, last) - 1);
    const PacketSize tail_bytes = tail_of(assembly, last, final_sequence);
    PacketIndex sequence = final_sequence;
    Slot slot = head(assembly);
    for (;; --sequence) {
      uint8_t* to = message + static_cast<uint16_t>(sequence * last.payload_max);
      const PacketSize size = sequence == final_sequence ? tail_bytes : last.payload_max;
      if (sequence == last.sequence) {
        memcpy(to, last.payload, size);
      } else {
        memcpy(to, slots_[slot].body, size);
        slot = slots_[slot].next;
      }
      if (sequence == 0) break;
    }
    release(i);
    return static_cast<uint16_t>(final_sequence * last.payload_max + tail_bytes);
  }

  /// Gives back what message `i` holds.
  void release(Index i) {
    Assembly& assembly = assemblies_[i];
    Slot slot = head(assembly);
    while (slot != kNoSlot) {
      const Slot next = slots_[slot].next;
      slots_[slot].next = free_;
      free_ = slot;
      slot = next;
    }
    begin(i);
  }

  /// Packets held of message `i`, one bit each.
  Mask held(Index i) const { return assemblies_[i].held; }

  // Of such a mask: with packet `sequence` as well; whether a packet before the last is missing;
  // how many packets.
  static Mask with(Mask mask, PacketIndex sequence) {
    return static_cast<Mask>(mask | static_cast<Mask>(static_cast<Mask>(1) << sequence));
  }
  static bool has_gap(Mask mask) { return static_cast<Mask>(mask & (mask + 1u)) != 0; }
  static uint8_t count(Mask mask) {
    uint8_t packets = 0;
    for (; mask != 0; mask = static_cast<Mask>(mask & (mask - 1u))) ++packets;
    return packets;
  }

 private:
  struct Assembly : KnownLength<!P::kPadded> {
    Mask held;
    Slot first;  // list of fragments, highest sequence first; kEnds: that is the message's last
  };
  struct Held {
    uint8_t body[W::kBodyBytes];  // payload; the running delay at the end of the first of a list
    Slot next;
  };

  static constexpr Slot kEnds = static_cast<Slot>(static_cast<Slot>(~static_cast<Slot>(0)) ^
                                                  (static_cast<Slot>(~static_cast<Slot>(0)) >> 1));
  static Slot head(const Assembly& assembly) {
    return static_cast<Slot>(assembly.first & static_cast<Slot>(~kEnds));
  }
  /// Packets of the whole message, if this packet or one held tells; else 0.
  static PacketIndex packets_of(const Assembly& assembly, const Fragment<P>& fragment) {
    if (fragment.packets != 0 || (assembly.first & kEnds) == 0) return fragment.packets;
    return width(assembly.held);
  }
  static PacketIndex width(Mask mask) {
    PacketIndex count = 0;
    for (; mask != 0; mask = static_cast<Mask>(mask >> 1)) ++count;
    return count;
  }

  static Mask full(PacketIndex packets) {
    return static_cast<Mask>(static_cast<Mask>(~static_cast<Mask>(0)) >>
                             (sizeof(Mask) * 8 - packets));
  }

  static bool contradicts(const Assembly& assembly, const Fragment<P>& fragment, Mask bit) {
    if (P::kSizeBits != 0 && assembly.held != 0 && assembly.length() != fragment.message_bytes) {
      return true;
    }
    if ((assembly.first & kEnds) != 0) {
      const PacketIndex packets = width(assembly.held);
      return fragment.packets != 0 ? fragment.packets != packets : fragment.sequence >= packets;
    }
    return fragment.packets != 0 && fragment.sequence + 1u == fragment.packets &&
           assembly.held >= bit && (assembly.held & bit) == 0;
  }

  bool is_held_equal(const Assembly& assembly, const Fragment<P>& fragment) const {
    Slot slot = head(assembly);
    for (Mask above = static_cast<Mask>(assembly.held >> fragment.sequence >> 1); above != 0;
         above = static_cast<Mask>(above & (above - 1))) {
      slot = slots_[slot].next;
    }
    return memcmp(slots_[slot].body, fragment.payload, fragment.payload_bytes) == 0;
  }

  static PacketSize tail_of(const Assembly& assembly, const Fragment<P>& last, PacketIndex final) {
    if (P::kSizeBits != 0)
      return static_cast<PacketSize>(last.message_bytes - final * last.payload_max);
    if (P::kPadded || last.sequence == final) return last.payload_bytes;
    return static_cast<PacketSize>(assembly.length());
  }

  void insert(Assembly& assembly, const Fragment<P>& fragment) {
    Slot slot = free_;
    if (slot != kNoSlot) {
      free_ = slots_[slot].next;
    } else {
      slot = used_++;
    }
    memcpy(slots_[slot].body, fragment.payload, fragment.payload_bytes);
    if (assembly.held < static_cast<Mask>(static_cast<Mask>(1) << fragment.sequence)) {
      slots_[slot].next = assembly.first;
      assembly.first = slot;
      return;
    }
    Slot before = head(assembly);
    for (Mask above = static_cast<Mask>(assembly.held >> fragment.sequence >> 1);
         (above & (above - 1u)) != 0; above = static_cast<Mask>(above & (above - 1u))) {
      before = slots_[before].next;
    }
    slots_[slot].next = slots_[before].next;
    slots_[before].next = slot;
  }

  /// Delay of the message so far: what it had when its last packet came, plus the wait since, or
  /// what this packet says if that is more. Saturates.
  Timestamp delay_now(const Assembly& assembly, const Fragment<P>& fragment, Ticks elapsed) const {
    if (!fragment.timestamped || assembly.held == 0) return fragment.delay;
    const Timestamp before = W::timestamp(slots_[head(assembly)].body, W::kBodyBytes);
    const Timestamp waited = W::later(before, elapsed);
    return waited > fragment.delay ? waited : fragment.delay;
  }

  Assembly assemblies_[P::kRecords];
  Held slots_[P::kFragmentSlots];
  Slot used_;  // slots 0..used_-1 have been used; the rest is untouched memory
  Slot free_;  // list of used ones that are free again
};

}  // namespace core
}  // namespace swarmtalk
