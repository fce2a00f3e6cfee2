// What a received packet goes through inside a node: wanted here or not, seen before or not, sent
// on, held until its message is whole, delivered; and which unfinished message makes place when
// memory is short. Definitions of Swarmtalk's members, included by swarmtalk.hpp only.
#pragma once

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {
namespace core {

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
  if (arrival.ttl != 0) forward(arrival, *record);
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
    if (record->is_open()) end(*record);
    record->flags = 0;
  }
  record = begin_record(record, arrival.key, kind, kind == 0 ? !whole : P::kMessageBits >= 16);
  if (record == nullptr) {
    // While all are open, one that cannot become whole makes place; for a flooded message that is
    // whole at once any does, because without a record its copies would be delivered again.
    record = give_up_less_than(kind != 0 && whole ? kAnyWorth : 1, nullptr);
    if (record != nullptr) cache_.replace(*record, arrival.key, kind);
  }
  return record;
}

template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::begin_record(Entry* own, typename Key::Argument key,
                                                         uint8_t kind, bool insist) {
  if (cache_.needs_secret()) draw_secret();
  return cache_.begin(own, key, kind, insist, *this);
}

template <class P>
void Swarmtalk<P>::forward(const Arrival& arrival, Entry& record) {
  if ((record.forwarded & arrival.bit) != 0) {
    forward_queue_.improve(arrival.packet(), arrival);
    return;
  }
  const auto pushed = forward_queue_.push(arrival.packet(), arrival.size_bytes, arrival,
                                          static_cast<typename W::WaitTicks>(cache_.now()));
  if (pushed != Pushed::kDone) count(counters_.forward_queue_full);
  if (pushed == Pushed::kFull) return;
  record.forwarded = static_cast<Mask>(record.forwarded | arrival.bit);
  if (!record.is_open()) cache_.renew_stamp(record);
  if (P::kBuckets != 0) cache_.set_waiting(forward_queue_.size());
  round_robin_.set_ready(0, true);
}

template <class P>
void Swarmtalk<P>::assemble(Arrival& arrival, Entry& record) {
  if (!record.is_open()) {
    reassembler_.begin(record);
    cache_.open(record);
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
  } while (outcome == Outcome::kNoSlot && make_slot(record, arrival.bit));
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

template <class P>
bool Swarmtalk<P>::make_slot(Entry& record, Mask bit) {
  const Mask held = record.held;
  if (!record.is_flood() &&
      (record.is_overtaken() || Reassembler<P>::has_gap(static_cast<Mask>(held | bit)))) {
    return false;
  }
  // A message that begins now comes after a walk.
  if (Cache::kScans && held != 0) cache_.look_at_others(record, *this);
  const auto limit = static_cast<uint8_t>(Reassembler<P>::count(held) + 1);
  return give_up_less_than(limit, &record) != nullptr;
}

template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::give_up_less_than(uint8_t limit, const Entry* kept) {
  Entry* const record = Cache::kScans ? this->take_least_under(limit) : find_less_than(limit, kept);
  if (record == nullptr || !record->is_open()) return nullptr;
  finish(*record, 0);
  count(counters_.no_memory);
  return record;
}

template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::find_less_than(uint8_t limit, const Entry* kept) {
  Entry* least = nullptr;
  const uint8_t enough = limit == kAnyWorth ? 3 : 0;
  Entry* const last = this->hand();
  Entry* record = last;
  uint8_t looks = 32;  // at most: the hand may stand behind the records in use
  do {
    record = cache_.next_after(record);
    if (!record->is_open() || record == kept) continue;
    const uint8_t its_worth = worth(*record);
    if (its_worth < limit) {
      least = record;
      limit = its_worth;
      if (limit <= enough) break;
    }
  } while (record != last && --looks != 0);
  this->hand() = record;
  return least;
}

}  // namespace core
}  // namespace swarmtalk
