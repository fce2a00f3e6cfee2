// The messages of others that a node has met: whether a packet is a copy, which messages are being
// put together, and which of these gives way when memory is short. Owned by the node, and counts in
// the node's counters what becomes of messages.
#pragma once

#include <stdint.h>

#include "swarmtalk/arrival.hpp"
#include "swarmtalk/counters.hpp"
#include "swarmtalk/duplicate_cache.hpp"
#include "swarmtalk/forecast.hpp"
#include "swarmtalk/reassembler.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class HeardMessages : private Forecast<P, (P::kBuckets == 0)> {
 public:
  using W = Wire<P>;
  using Entry = Record<P>;
  using Mask = typename W::PacketMask;
  using Ticks = UintFor<P::kClockBits>;

  SWARMTALK_PART(HeardMessages)
  void start() {
    Forecast<P, Cache::kScans>::start();
    cache_.start();
    reassembler_.start();
  }

  /// See DuplicateCache. REQUIRES forget_all() then.
  bool has_ended(uint32_t now) const { return cache_.has_ended(now); }
  void forget_all() {
    cache_.forget_all();
    reassembler_.forget_all();
  }
  /// The time of what follows, until the next call. What is over by then is given up.
  void set_now(uint32_t now) {
    const uint32_t passed = cache_.since_now(now);
    cache_.set_now(now);
    cache_.sweep(passed, *this);
  }
  uint32_t now() const { return cache_.now(); }
  /// Ticks from the time set last to `time`.
  uint32_t since_now(uint32_t time) const { return cache_.since_now(time); }
  /// @param packets  that wait to be sent on here
  SWARMTALK_AVR_INLINED void set_waiting(uint16_t packets) { cache_.set_waiting(packets); }

  void draw_secret(const Port& port) { cache_.draw_secret(port); }
  bool knows_node(typename W::NodeId node) const { return cache_.knows_node(node); }

  /// The record of a packet's message, a new one if needed. @return null: no room
  /// @param kind  Arrival::kind(), or 0 for one hop
  Entry* record_of(const Arrival<P>& arrival, uint8_t kind, bool whole);
  /// A packet of a flooded message came by a forwarder.
  void hear_copy(Entry& record) { cache_.hear_copy(record); }
  /// The packet is to be sent on.
  void note_forwarded(Entry& record, Mask bit) {
    record.forwarded = static_cast<Mask>(record.forwarded | bit);
    if (!record.is_open()) cache_.renew_stamp(record);
  }
  /// The message came in one packet.
  void close(Entry& record) { cache_.close(record, kAllPackets); }
  /// Adds a packet to its message.
  /// @param message  W::kMessageBytes; gets the message, if it is whole now
  /// @param arrival  gets the largest delay of all packets, if the message is whole now
  /// @return bytes of the message; 0: it is not whole
  uint16_t add(Arrival<P>& arrival, Entry& record, uint8_t* message);

  Counters<P> counters;

 private:
  friend class DuplicateCache<P>;
  using Cache = DuplicateCache<P>;
  using Outcome = typename Reassembler<P>::Outcome;
  static constexpr Mask kAllPackets = static_cast<Mask>(~Mask{0});

  /// An open message's time is over, or its number comes again.
  SWARMTALK_AVR_CALLED void expire(Entry& record) {
    reassembler_.release(record);
    counters.count(counters.aged_out);
  }
  /// An open message is delivered, or given up.
  /// @param heard  packets of it that have come beside those held, or 0
  SWARMTALK_AVR_INLINED void finish(Entry& record, Mask heard) {
    reassembler_.release(record);
    cache_.close(record, static_cast<Mask>(record.held | heard));
  }
  /// Whether memory will do for the message that this packet begins. Where the length of messages
  /// is known, one of one hop has to begin with its first packet.
  bool is_finishable(const Arrival<P>& arrival, const Entry& record) const {
    return !this->knows_length() || record.is_flood() || (arrival.bit == 1 && this->has_room());
  }
  /// What keeping an open message is worth: nothing if it cannot become whole any more, as far as
  /// one can tell, else more with each packet held. To finish what has come farthest takes the
  /// least memory for a message. (One hop means in order: a gap is a loss, and so is the sender's
  /// next.)
  SWARMTALK_AVR_INLINED uint8_t worth(const Entry& record) const {
    const bool is_hopeless = record.is_flood()
                                 ? cache_.is_stale(record)
                                 : record.is_overtaken() || Reassembler<P>::has_gap(record.held);
    return is_hopeless ? 0 : static_cast<uint8_t>(Reassembler<P>::count(record.held) + 1);
  }
  static constexpr uint8_t kAnyWorth = 255;
  /// Gives up the open message that is worth least, if that is less than `limit` (kAnyWorth: in any
  /// case). Without buckets it is known from the last walk over the records.
  /// @param kept  not this one; without buckets the walk has left it out
  /// @return it, now closed, or null
  Entry* give_up_less_than(uint8_t limit, const Entry* kept);
  /// Finds it in a large table, by standing: of some that hold packets, the least, and the oldest.
  Entry* find_less_than(uint8_t limit, const Entry* kept);
  /// Gives up a message that is worth less than this packet's, which needs a slot.
  /// @return whether there was one
  bool make_slot(Entry& record, const Arrival<P>& arrival);
  /// What a packet's message may push out, of which `held` are here: what is worth less than this.
  static uint8_t limit_of(Mask held, const Arrival<P>& arrival);
  /// In a large table, how an open message stands among others: 0 if it is worth nothing;
  /// kEndAlone; kStalled, and one more for each packet held, less one for each kStall in which none
  /// has come.
  uint8_t standing(const Entry& record) const;
  static constexpr uint8_t kEndAlone = 1;
  static constexpr uint8_t kStalled = 2;
  static constexpr uint32_t kStall = P::kAssemblyTicks < 8 ? 1 : P::kAssemblyTicks / 8;

  Cache cache_;
  Reassembler<P> reassembler_;
};

template <class P>
typename HeardMessages<P>::Entry* HeardMessages<P>::record_of(const Arrival<P>& arrival,
                                                              uint8_t kind, bool whole) {
  Entry* record = cache_.find(arrival.key);
  if (record != nullptr) {
    if (!cache_.is_of_later(*record, (kind & Entry::kDirect) != 0, arrival.bit)) return record;
    if (record->is_open()) expire(*record);
    record->flags = 0;
  }
  const bool insist = kind == 0 ? !whole : P::kMessageBits >= 16;
  record = cache_.begin_record(record, arrival.key, kind, insist, *this);
  if (record == nullptr) {
    // Where no closed one may be taken, an open one makes place that is worth less; for a flooded
    // message that is whole at once any does, because without a record its copies would be
    // delivered again.
    record = give_up_less_than(kind != 0 && whole ? kAnyWorth : limit_of(0, arrival), nullptr);
    if (record != nullptr) cache_.replace(*record, arrival.key, kind);
  }
  return record;
}

template <class P>
SWARMTALK_AVR_INLINED uint16_t HeardMessages<P>::add(Arrival<P>& arrival, Entry& record,
                                                     uint8_t* message) {
  if (!record.is_open()) {
    reassembler_.begin(record);
    cache_.renew_stamp(record);
    if (!is_finishable(arrival, record)) {
      finish(record, arrival.bit);
      counters.count(counters.no_memory);
      return 0;
    }
  }
  const Ticks elapsed = cache_.age(record);
  Outcome outcome;
  do {
    outcome = reassembler_.add(record, arrival, elapsed);
  } while (outcome == Outcome::kNoSlot && make_slot(record, arrival));
  switch (outcome) {
    case Outcome::kHeld:
      cache_.renew_stamp(record);
      break;
    case Outcome::kComplete: {
      this->set_usual_packets(static_cast<uint8_t>(Reassembler<P>::count(record.held) + 1));
      const uint16_t size = reassembler_.take(record, arrival, elapsed, message);
      finish(record, kAllPackets);
      return size;
    }
    case Outcome::kDuplicate:
      counters.count(counters.duplicates);
      break;
    case Outcome::kContradiction:
      finish(record, arrival.bit);
      counters.count(counters.contradictions);
      break;
    case Outcome::kNoSlot:
      finish(record, arrival.bit);
      counters.count(counters.no_memory);
      break;
  }
  return 0;
}

// In a large table a packet of full length is more than a last one, which may have a byte: a
// message that begins with it comes before those of which only the end has come, and before what
// has not moved for a while. Last packets alone push out each other, the oldest first, and what
// cannot become whole. So whatever fills the pool with packets of messages that never become whole,
// under however many names, has to send all that it holds again in each kStall.
template <class P>
uint8_t HeardMessages<P>::limit_of(Mask held, const Arrival<P>& arrival) {
  const uint8_t packets = Reassembler<P>::count(held);
  if (Cache::kScans) return static_cast<uint8_t>(packets + 1);
  if (packets == 0) return arrival.end ? kStalled : kStalled + 1;
  return static_cast<uint8_t>(kStalled + packets);
}

template <class P>
bool HeardMessages<P>::make_slot(Entry& record, const Arrival<P>& arrival) {
  const Mask held = record.held;
  if (!record.is_flood() &&
      (record.is_overtaken() || Reassembler<P>::has_gap(static_cast<Mask>(held | arrival.bit)))) {
    return false;
  }
  // A message that begins now comes after a walk.
  if (Cache::kScans && held != 0) cache_.look_at_others(record, *this);
  return give_up_less_than(limit_of(held, arrival), &record) != nullptr;
}

template <class P>
uint8_t HeardMessages<P>::standing(const Entry& record) const {
  if (worth(record) == 0) return 0;
  const Mask held = record.held;
  const bool is_end_alone =
      (record.flags & Entry::kEndHeld) != 0 && static_cast<Mask>(held & (held - 1u)) == 0;
  if (is_end_alone) return kEndAlone;
  const uint8_t packets = Reassembler<P>::count(held);
  const auto idle = static_cast<uint32_t>(cache_.age(record) / kStall);
  return static_cast<uint8_t>(kStalled + (idle < packets ? packets - idle : 0));
}

template <class P>
typename HeardMessages<P>::Entry* HeardMessages<P>::give_up_less_than(uint8_t limit,
                                                                      const Entry* kept) {
  Entry* const record = Cache::kScans ? this->take_least_under(limit) : find_less_than(limit, kept);
  if (record == nullptr || !record->is_open()) return nullptr;
  finish(*record, 0);
  counters.count(counters.no_memory);
  return record;
}

// The pool of slots is walked, not the records: each open message that holds something is met.
template <class P>
typename HeardMessages<P>::Entry* HeardMessages<P>::find_less_than(uint8_t limit,
                                                                   const Entry* kept) {
  constexpr typename Entry::Slot kLooks = P::kFragmentSlots < 64 ? P::kFragmentSlots : 64;
  Entry* least = nullptr;
  uint8_t least_standing = limit;
  for (auto left = kLooks; left != 0; --left) {
    Entry* const record = reassembler_.next_holder();
    if (record == nullptr || !record->is_open() || record == kept) continue;
    const uint8_t its_standing = standing(*record);
    const bool is_older = least != nullptr && its_standing == least_standing &&
                          cache_.age(*record) > cache_.age(*least);
    if (its_standing >= least_standing && !is_older) continue;
    least = record;
    least_standing = its_standing;
  }
  return least;
}

}  // namespace core
}  // namespace swarmtalk
