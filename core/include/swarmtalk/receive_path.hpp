// What a received packet goes through inside a node: wanted here or not, seen before or not, held
// until its message is whole, delivered; and which unfinished message makes place when memory is
// short. Definitions of Swarmtalk's members, included by swarmtalk.hpp only.
#pragma once

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {
namespace core {

template <class P>
bool Swarmtalk<P>::read_fragment(Arrival& arrival, const uint8_t* packet) const {
  PacketSize body_bytes =
      P::kPadded
          ? W::kBodyBytes
          : static_cast<PacketSize>(arrival.size_bytes - W::kHeaderBytes - W::kChecksumBytes);
  const uint8_t* body = packet + W::kHeaderBytes;
  arrival.payload = body;
  arrival.delay_ticks = 0;
  if (arrival.has_delay) {
    if (body_bytes < W::kTimestampBytes) return false;
    arrival.delay_ticks = W::timestamp(body, body_bytes);
    body_bytes = static_cast<PacketSize>(body_bytes - W::kTimestampBytes);
  }
  arrival.payload_bytes = body_bytes;
  if (W::kMaxPackets < (UINT32_C(1) << P::kSequenceBits) && arrival.sequence >= W::kMaxPackets) {
    return false;
  }
  arrival.bit = W::bit_of(arrival.sequence);
  // Where nothing marks timestamps, who does not have the channel cannot know: it only forwards.
  const bool is_of_either_kind =
      !W::kMarksTimestamps && P::kTimestampBits != 0 && arrival.to == nullptr;
  if (P::kSizeBits != 0) {
    return fits_size(arrival, arrival.has_delay, body_bytes) ||
           (is_of_either_kind && body_bytes >= W::kTimestampBytes &&
            fits_size(arrival, true, static_cast<PacketSize>(body_bytes - W::kTimestampBytes)));
  }
  if (W::kLimitsPlaces && !is_of_either_kind &&
      !W::is_within_message(arrival.sequence, arrival.end, arrival.has_delay, body_bytes)) {
    return false;
  }
  if (P::kPadded) return true;
  return arrival.end ? arrival.sequence == 0 || body_bytes != 0
                     : body_bytes == arrival.payload_max();
}

template <class P>
inline bool Swarmtalk<P>::fits_size(const Arrival& arrival, bool timestamped,
                                    PacketSize payload_bytes) {
  const uint16_t limit = timestamped ? W::kTimedMessageBytes : W::kMessageBytes;
  if (arrival.size > limit) return false;
  const PacketSize payload_max =
      static_cast<PacketSize>(timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes);
  const uint16_t packets = W::packets_for(arrival.size, payload_max);
  if (arrival.end != (arrival.sequence + 1u == packets) || arrival.sequence >= packets) {
    return false;
  }
  return payload_bytes ==
         (arrival.end ? arrival.size - arrival.sequence * payload_max : payload_max);
}

template <class P>
bool Swarmtalk<P>::is_own(const Arrival& arrival) {
  if (!identity_.is_drawn() || arrival.node != identity_.id()) return false;
  if (is_echo(arrival)) {
    count(counters_.own_echoes);
    return true;
  }
  count(counters_.id_collisions);
  if (!identity_.is_fixed()) {
    draw_id();
    count(counters_.id_changes);
  }
  return P::kEpochBits == 0;
}

template <class P>
void Swarmtalk<P>::receive(Arrival& arrival) {
  bool wanted = arrival.to != nullptr && arrival.to->has_subscribers();
  if (!wanted) {
    count(counters_.unknown_channels);
  } else if (!arrival.to->wants(arrival.sensing)) {
    count(counters_.too_far);
    wanted = false;
  }
  if (!wanted && arrival.ttl == 0) return;
  const uint8_t kind = arrival.ttl != 0 || arrival.to->ttl_ != 0 ? kind_of(arrival) : uint8_t{0};
  const bool whole = arrival.end && arrival.sequence == 0;
  Entry* const record = record_of(arrival, kind, whole);
  // Without a record the copies of a flooded message could not be told from it.
  if (record == nullptr && (kind != 0 || !whole)) return count(counters_.no_memory);
  if ((kind & (Entry::kFlood | Entry::kDirect)) == Entry::kFlood) cache_.hear_copy(*record);
  if (this->is_sent_on(arrival.ttl)) forward(arrival, *record);
  if (!wanted) return;
  if (record != nullptr) {
    if (record->is_done()) {
      record->held = static_cast<Mask>(record->held | arrival.bit);
      return count(counters_.duplicates);
    }
    if (!whole || record->is_open()) return assemble(arrival, *record);
    cache_.close(*record, kAllPackets);
  }
  deliver(arrival, arrival.payload, arrival.payload_bytes);
}

template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::record_of(const Arrival& arrival, uint8_t kind,
                                                      bool whole) {
  Entry* record = cache_.find(arrival.key);
  if (record != nullptr) {
    if (!cache_.is_of_later(*record, (kind & Entry::kDirect) != 0, arrival.bit)) return record;
    if (record->is_open()) expire(*record);
    record->flags = 0;
  }
  record = begin_record(record, arrival.key, kind, kind == 0 ? !whole : P::kMessageBits >= 16);
  if (record == nullptr) {
    // While all are open, one that cannot become whole makes place; for a flooded message that is
    // whole at once any does, because without a record its copies would be delivered again.
    record = give_up_less_than(kind != 0 && whole ? kAnyWorth : limit_of(0, arrival), nullptr);
    if (record != nullptr) cache_.replace(*record, arrival.key, kind);
  }
  return record;
}

template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::begin_record(Entry* own, typename Key::Argument key,
                                                         uint8_t kind, bool insist) {
  if (cache_.needs_secret()) draw_secret();
  return cache_.begin_record(own, key, kind, insist, *this);
}

template <class P>
void Swarmtalk<P>::assemble(Arrival& arrival, Entry& record) {
  if (!record.is_open()) {
    reassembler_.begin(record);
    cache_.renew_stamp(record);
    if (!is_finishable(arrival, record)) {
      finish(record, arrival.bit);
      count(counters_.no_memory);
      return;
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
    case Outcome::kComplete:
      complete(arrival, record, elapsed);
      break;
    case Outcome::kDuplicate:
      count(counters_.duplicates);
      break;
    case Outcome::kContradiction:
      finish(record, arrival.bit);
      count(counters_.contradictions);
      break;
    case Outcome::kNoSlot:
      finish(record, arrival.bit);
      count(counters_.no_memory);
      break;
  }
}

template <class P>
void Swarmtalk<P>::complete(Arrival& arrival, Entry& record, Ticks elapsed) {
  uint8_t message[W::kMessageBytes];
  this->set_usual_packets(static_cast<uint8_t>(Reassembler<P>::count(record.held) + 1));
  const uint16_t size = reassembler_.take(record, arrival, elapsed, message);
  finish(record, kAllPackets);
  deliver(arrival, message, size);
}

template <class P>
void Swarmtalk<P>::deliver(Arrival& arrival, const uint8_t* bytes, uint16_t size) {
  if (P::kHopsBits == 0) {
    const uint8_t sent_ttl = arrival.to->ttl_;
    arrival.hops = P::kHopsFromTtl && sent_ttl >= arrival.ttl
                       ? static_cast<uint8_t>(sent_ttl - arrival.ttl)
                       : kHopsUnknown;
  }
  count(counters_.messages_received);
  arrival.to->deliver(bytes, size, arrival);
}

template <class P>
void Swarmtalk<P>::finish(Entry& record, Mask heard) {
  reassembler_.release(record);
  cache_.close(record, static_cast<Mask>(record.held | heard));
}

template <class P>
uint8_t Swarmtalk<P>::worth(const Entry& record) const {
  const bool is_hopeless = record.is_flood()
                               ? cache_.is_stale(record)
                               : record.is_overtaken() || Reassembler<P>::has_gap(record.held);
  return is_hopeless ? 0 : static_cast<uint8_t>(Reassembler<P>::count(record.held) + 1);
}

// In a large table a packet of full length is more than a last one, which may have a byte: a
// message that begins with it comes before those of which only the end has come, and before what
// has not moved for a while. Last packets alone push out each other only, the oldest first. So who
// fills the pool with packets of messages that never become whole, under however many names, has to
// send all that it holds again in each kStall.
template <class P>
uint8_t Swarmtalk<P>::limit_of(Mask held, const Arrival& arrival) {
  const uint8_t packets = Reassembler<P>::count(held);
  if (Cache::kScans) return static_cast<uint8_t>(packets + 1);
  if (packets == 0) return arrival.end ? kStalled : kStalled + 1;
  return static_cast<uint8_t>(kStalled + packets);
}

template <class P>
bool Swarmtalk<P>::make_slot(Entry& record, const Arrival& arrival) {
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
uint8_t Swarmtalk<P>::standing(const Entry& record) const {
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
typename Swarmtalk<P>::Entry* Swarmtalk<P>::give_up_less_than(uint8_t limit, const Entry* kept) {
  Entry* const record = Cache::kScans ? this->take_least_under(limit) : find_less_than(limit, kept);
  if (record == nullptr || !record->is_open()) return nullptr;
  finish(*record, 0);
  count(counters_.no_memory);
  return record;
}

// The pool of slots is walked, not the records: each open message that holds something is met.
template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::find_less_than(uint8_t limit, const Entry* kept) {
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
