// Puts messages together from their packets, which may come in any order. Owned by the node. Holds
// one pool of fragments for all channels; a message's fragments are a list that begins in its
// record. The packet that completes a message is never stored.
//
// Cost per packet: the length of its own message at most, whatever else is held.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/record.hpp"
#include "swarmtalk/sensing.hpp"
#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// One packet's share of a message, as the node has checked it. `delay_ticks` is what it says of
/// its way here.
template <class P>
struct Fragment : Reception<P> {
  const uint8_t* payload;  // with Wire<P>::kBodyBytes readable bytes where packets are padded
  typename Wire<P>::PacketSize payload_bytes;
  typename Wire<P>::PacketMask bit;  // of its place in the message, 1 for the first

  /// Bytes in each packet of the message but the last.
  typename Wire<P>::PacketSize payload_max() const {
    return static_cast<typename Wire<P>::PacketSize>(
        P::kPadded ? payload_bytes
                   : (this->has_delay ? Wire<P>::kTimedPayloadBytes : Wire<P>::kPayloadBytes));
  }
};

/// Whose packet a slot holds, where there is memory to tell.
template <class P, bool kPresent>
class SlotOwners {
 protected:
  using Slot = typename Record<P>::Slot;
  void set_owner(Slot slot, Record<P>& record) { owners_[slot] = &record; }
  /// Goes round the first `used` slots. @return the message whose packet this one holds, or held
  /// last; null: none was ever used
  Record<P>* next_owner(Slot used) {
    if (++at_ >= used) at_ = 0;
    return used == 0 ? nullptr : owners_[at_];
  }

 private:
  uint32_t at_ = 0;
  Record<P>* owners_[P::kFragmentSlots];  // untouched until used
};
template <class P>
class SlotOwners<P, false> {
 protected:
  using Slot = typename Record<P>::Slot;
  void set_owner(Slot, Record<P>&) {}
  Record<P>* next_owner(Slot) { return nullptr; }
};

template <class P>
class Reassembler : private SlotOwners<P, (P::kBuckets > 0)> {
 public:
  using W = Wire<P>;
  using Entry = Record<P>;
  using Mask = typename W::PacketMask;
  using Timestamp = typename W::Timestamp;
  using Ticks = typename W::Ticks;
  using PacketSize = typename W::PacketSize;
  using Slot = typename Entry::Slot;
  static constexpr Slot kNoSlot = P::kFragmentSlots;

  enum class Outcome : uint8_t {
    kHeld,           // stored; more is to come
    kComplete,       // with this packet: call take()
    kDuplicate,      // this packet is held already
    kContradiction,  // this packet cannot be of the message that is held
    kNoSlot,         // no fragment slot: make room and try again, or release()
  };

  SWARMTALK_PART(Reassembler)
  void start() {
    set_zero(used_);
    free_ = kNoSlot;
  }
  /// Each call the next of the messages whose packets are held; some are over. Null: there are none
  Entry* next_holder() { return this->next_owner(used_); }
  void forget_all() {
    used_ = 0;
    free_ = kNoSlot;
  }

  /// Begins a message, nothing held.
  void begin(Entry& record) {
    record.held = 0;
    record.first = kNoSlot;
    record.flags = static_cast<uint8_t>((record.flags & ~Entry::kEndHeld) | Entry::kOpen);
  }

  /// Adds a packet to a message that has been begun. @param elapsed ticks since its last packet
  Outcome add(Entry& record, const Fragment<P>& fragment, Ticks elapsed) {
    if (!is_alike(record, fragment)) return Outcome::kContradiction;
    const Mask bit = fragment.bit;
    const Mask before = record.held;
    const bool end_held = (record.flags & Entry::kEndHeld) != 0;
    Slot* const link = link_of(record, bit);
    if ((before & bit) != 0) {
      return memcmp(slot_at(*link).body, fragment.payload, fragment.payload_bytes) == 0
                 ? Outcome::kDuplicate
                 : Outcome::kContradiction;
    }
    // Nothing comes behind the end, and the end not before anything.
    if (bit > before ? end_held : fragment.end) return Outcome::kContradiction;
    const Mask held = static_cast<Mask>(before | bit);
    if ((end_held || fragment.end) && !has_gap(held)) return Outcome::kComplete;
    return hold(record, *link, fragment, elapsed);
  }

  /// The message that `last` completed (add() answered kComplete), written to `message`
  /// (W::kMessageBytes). Its fragments stay.
  /// @return bytes of the message; `last` gets the largest delay of all its packets until now
  uint16_t take(const Entry& record, Fragment<P>& last, Ticks elapsed, uint8_t* message) {
    last.delay_ticks = delay_now(record, last, elapsed);
    const PacketSize payload_max = last.payload_max();
    Mask bit = 1;  // of the highest packet, which begins at byte `at`
    uint16_t at = 0;
    for (const Mask held = record.held | last.bit; bit != static_cast<Mask>(held - (held >> 1));) {
      bit = static_cast<Mask>(bit << 1);
      at = static_cast<uint16_t>(at + payload_max);
    }
    PacketSize size = tail_of(record, last, at, bit);
    const uint16_t total = static_cast<uint16_t>(at + size);
    for (Slot slot = record.first; bit != 0; bit = static_cast<Mask>(bit >> 1)) {
      const uint8_t* from = last.payload;
      if (bit != last.bit) {
        from = slot_at(slot).body;
        slot = slot_at(slot).next;
      }
      memcpy(message + at, from, size);
      at = static_cast<uint16_t>(at - payload_max);
      size = payload_max;
    }
    return total;
  }

  /// Gives back what an open message holds. Its record is to be closed or freed with it.
  void release(Entry& record) {
    if (kKeepsLists) {
      if (record.first != kNoSlot) give_back(record.first);
      return;
    }
    Slot* link = &record.first;
    while (*link != kNoSlot) link = &slot_at(*link).next;
    *link = free_;
    free_ = record.first;
  }

  // Of a mask of packets held: whether a packet before the last is missing; how many packets.
  static bool has_gap(Mask mask) { return static_cast<Mask>(mask & (mask + 1u)) != 0; }
  static SWARMTALK_AVR_INLINED uint8_t count(Mask mask) {
    if (sizeof(Mask) == 1) {  // in pairs, fours, all eight: no loop
      uint8_t sums = static_cast<uint8_t>(mask - (mask >> 1 & 0x55u));
      sums = static_cast<uint8_t>((sums & 0x33u) + (sums >> 2 & 0x33u));
      return static_cast<uint8_t>((sums + (sums >> 4)) & 0x0Fu);
    }
    uint8_t packets = 0;
    for (; mask != 0; mask = static_cast<Mask>(mask & (mask - 1u))) ++packets;
    return packets;
  }

 private:
  /// Whether what is free is a list of messages' lists: none is walked along when it is given back.
  static constexpr bool kKeepsLists = P::kBuckets == 0;
  struct Held {
    // Payload; the running delay at the end of the first of a list. In a free list's first: the
    // first of the next free list.
    uint8_t body[W::kBodyBytes < sizeof(Slot) ? sizeof(Slot) : W::kBodyBytes];
    Slot next;
  };

  /// Whether a packet may be of the message that is held: it tells the same size, and has a
  /// timestamp if the others have. (Without one there is room for more, and places would differ.)
  static bool is_alike(const Entry& record, const Fragment<P>& fragment) {
    return record.held == 0 || ((P::kSizeBits == 0 || record.length() == fragment.size) &&
                                !record.is_other(fragment.has_delay));
  }

  /// Stores a packet of a message at `link` of its list.
  SWARMTALK_AVR_INLINED Outcome hold(Entry& record, Slot& link, const Fragment<P>& fragment,
                                     Ticks elapsed) {
    const Timestamp delay = delay_now(record, fragment, elapsed);
    const Slot slot = unused_slot();
    if (slot == kNoSlot) return Outcome::kNoSlot;
    Held& place = slot_at(slot);
    // The bytes of a padded packet behind its payload are there, and are not used.
    memcpy(place.body, fragment.payload, P::kPadded ? W::kBodyBytes : fragment.payload_bytes);
    place.next = link;
    link = slot;
    this->set_owner(slot, record);
    record.held = static_cast<Mask>(record.held | fragment.bit);
    record.set_timestamps(fragment.has_delay);
    if (fragment.has_delay) {
      W::set_timestamp(slot_at(record.first).body, W::kBodyBytes, delay);
    }
    if (P::kSizeBits != 0) record.set_length(fragment.size);
    if (fragment.end) {
      record.flags = static_cast<uint8_t>(record.flags | Entry::kEndHeld);
      if (P::kSizeBits == 0) record.set_length(fragment.payload_bytes);
    }
    return Outcome::kHeld;
  }

  SWARMTALK_AVR_CALLED Held& slot_at(Slot slot) { return slots_[slot]; }
  /// The link of a message's list at which packet `bit` is, or would be.
  SWARMTALK_AVR_INLINED Slot* link_of(Entry& record, Mask bit) {
    Slot* link = &record.first;
    for (Mask above = static_cast<Mask>(record.held & (0u - bit - bit)); above != 0;
         above = static_cast<Mask>(above & (above - 1u))) {
      link = &slot_at(*link).next;
    }
    return link;
  }

  Slot unused_slot() {
    const Slot slot = free_;
    if (slot != kNoSlot) {
      const Held& taken = *in_register(&slot_at(slot));
      free_ = kKeepsLists ? first_of_rest(taken) : taken.next;
      return slot;
    }
    return used_ == P::kFragmentSlots ? kNoSlot : used_++;
  }

  /// A message's list, not empty, is free.
  void give_back(Slot first) {
    memcpy(slot_at(first).body, &free_, sizeof(Slot));
    free_ = first;
  }
  /// What is free once the first slot of all is taken.
  Slot first_of_rest(const Held& taken) {
    Slot others;
    memcpy(&others, taken.body, sizeof(Slot));
    const Slot rest = taken.next;
    if (rest == kNoSlot) return others;
    memcpy(slot_at(rest).body, &others, sizeof(Slot));
    return rest;
  }

  static PacketSize tail_of(const Entry& record, const Fragment<P>& last, uint16_t at, Mask top) {
    if (P::kSizeBits != 0) return static_cast<PacketSize>(last.size - at);
    if (P::kPadded || last.bit == top) return last.payload_bytes;
    return static_cast<PacketSize>(record.length());
  }

  /// Delay of the message so far: what it had when its last packet came, plus the wait since, or
  /// what this packet says if that is more. Saturates.
  SWARMTALK_AVR_INLINED Timestamp delay_now(const Entry& record, const Fragment<P>& fragment,
                                            Ticks elapsed) {
    if (!fragment.has_delay || record.held == 0) return fragment.delay_ticks;
    const Timestamp before = W::timestamp(slot_at(record.first).body, W::kBodyBytes);
    const Timestamp waited = W::later(before, elapsed);
    return waited > fragment.delay_ticks ? waited : fragment.delay_ticks;
  }

  Slot used_;  // slots 0..used_-1 have been used; the rest is untouched memory
  Slot free_;  // list of used ones that are free again, or of lists of them
  Held slots_[P::kFragmentSlots];
};

}  // namespace core
}  // namespace swarmtalk
