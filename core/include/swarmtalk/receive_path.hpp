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
  const bool flood = arrival.ttl != 0 || arrival.to->ttl_ != 0;
  const bool whole = arrival.end && arrival.sequence == 0;
  Entry* const record = record_of(arrival.key, flood, whole);
  if (arrival.ttl != 0) forward(arrival, record);
  if (!wanted) return;
  if (record == nullptr) {
    if (!whole) return count(counters_.no_memory);
  } else {
    if (record->is_done()) return count(counters_.duplicates);
    if (!whole || record->is_open()) return assemble(arrival, *record);
    cache_.close(*record, Entry::kDelivered);
  }
  deliver(arrival, arrival.payload, arrival.payload_bytes);
}

template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::record_of(typename Key::Argument key, bool flood,
                                                      bool whole) {
  Entry* record = cache_.find(key);
  if (record != nullptr) {
    if (record->is_open() && cache_.is_expired(*record)) {
      reassembler_.release(*record);
      cache_.renew(*record, flood);
      count(counters_.aged_out);
    }
    return record;
  }
  record = cache_.insert(key, flood, flood || !whole);
  if (record == nullptr) {
    // While all are open, one that cannot become whole makes place; for a flooded message that is
    // whole at once any does, because without a record its copies would be delivered again.
    record = give_up_less_than(flood && whole ? kAnyWorth : 1, nullptr);
    if (record != nullptr) cache_.replace(*record, key, flood);
  }
  return record;
}

template <class P>
void Swarmtalk<P>::forward(const Arrival& arrival, Entry* record) {
  if (record == nullptr) {
    count(counters_.no_memory);
    return;
  }
  if ((record->forwarded & arrival.bit) != 0) {
    forward_queue_.improve(arrival.packet(), arrival);
    return;
  }
  if (!forward_queue_.push(arrival.packet(), arrival.size_bytes, arrival, now())) {
    count(counters_.forward_queue_full);
    return;
  }
  record->forwarded = static_cast<Mask>(record->forwarded | arrival.bit);
  round_robin_.set_ready(0, true);
}

template <class P>
void Swarmtalk<P>::assemble(Arrival& arrival, Entry& record) {
  if (!record.is_open()) {
    reassembler_.begin(record);
    cache_.open(record);
    if (!is_finishable(arrival, record)) {
      give_up(record);
      count(counters_.no_memory);
      return;
    }
  }
  const Ticks elapsed = cache_.since_last_packet(record);
  Outcome outcome;
  do {
    outcome = reassembler_.add(record, arrival, elapsed);
  } while (outcome == Outcome::kNoSlot &&
           give_up_less_than(worth(record, arrival.bit), &record) != nullptr);
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
      give_up(record);
      count(counters_.contradictions);
      break;
    case Outcome::kNoSlot:
      give_up(record);
      count(counters_.no_memory);
      break;
  }
}

template <class P>
void Swarmtalk<P>::complete(Arrival& arrival, Entry& record, Ticks elapsed) {
  uint8_t message[W::kMessageBytes];
  this->set_usual_packets(worth(record, 0));
  const uint16_t size = reassembler_.take(record, arrival, elapsed, message);
  cache_.close(record, Entry::kDelivered);
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
void Swarmtalk<P>::give_up(Entry& record) {
  reassembler_.release(record);
  cache_.close(record, Entry::kGivenUp);
}

template <class P>
uint8_t Swarmtalk<P>::worth(const Entry& record, Mask bit) {
  // One hop means in order: a gap is a loss, and so is the sender's next message.
  if ((record.flags & Entry::kFlood) == 0 &&
      ((record.flags & Entry::kOvertaken) != 0 ||
       Reassembler<P>::has_gap(static_cast<Mask>(record.held | bit)))) {
    return 0;
  }
  return static_cast<uint8_t>(Reassembler<P>::count(record.held) + 1);
}

template <class P>
bool Swarmtalk<P>::is_finishable(const Arrival& arrival, const Entry& record) const {
  using Slots = UintFor<bits_for(UINT32_C(1) * P::kRecords * W::kMaxPackets + P::kFragmentSlots)>;
  const uint8_t packets = this->usual_packets();
  if (packets < 2 || (record.flags & Entry::kFlood) != 0) return true;
  if (arrival.bit != 1) return false;
  uint8_t messages = 0;  // that can still become whole, this one included
  Slots held = 1;
  uint8_t most = 2;
  const Entry* const end = cache_.end();
  for (const Entry* begun = cache_.begin(); begun != end; begun = in_register(begun + 1)) {
    if (!begun->is_open()) continue;
    const uint8_t its_worth = worth(*begun, 0);
    if (its_worth == 0 || its_worth >= packets) return true;  // packets get lost, or it ends
    ++messages;
    held = static_cast<Slots>(held + its_worth - 1u);
    if (its_worth > most) most = its_worth;
  }
  // When the farthest is about to end, each has grown by as much as it.
  return static_cast<Slots>(messages * static_cast<uint8_t>(packets - most) + held) <=
         P::kFragmentSlots;
}

template <class P>
typename Swarmtalk<P>::Entry* Swarmtalk<P>::give_up_less_than(uint8_t limit, const Entry* kept) {
  Entry* victim = nullptr;
  const uint8_t enough = limit == kAnyWorth ? 3 : 0;
  const auto start = victim_hand_;
  uint8_t looks = 32;  // at most
  do {
    Entry* const record = cache_.next_after(victim_hand_);
    if (!record->is_open() || record == kept) continue;
    const uint8_t its_worth = worth(*record, 0);
    if (its_worth < limit) {
      victim = record;
      limit = its_worth;
      if (limit <= enough) break;
    }
  } while (victim_hand_ != start && --looks != 0);
  if (victim == nullptr) return nullptr;
  give_up(*victim);
  count(counters_.no_memory);
  return victim;
}

}  // namespace core
}  // namespace swarmtalk
