// What a received packet goes through inside a node: wanted here or not, seen before or not, sent
// on, held until its message is whole, delivered; and which unfinished message makes place when
// memory is short. Definitions of Swarmtalk's members, included by swarmtalk.hpp only.
#pragma once

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {
namespace core {

template <class P>
SWARMTALK_HOT void Swarmtalk<P>::receive(Arrival& arrival, const Fragment<P>& fragment) {
  const Header& header = arrival.header;
  bool wanted = arrival.channel != nullptr && arrival.channel->subscriber_count_ != 0;
  if (!wanted) {
    count(counters_.unknown_channels);
  } else if (!arrival.channel->wants(*arrival.sensing)) {
    count(counters_.too_far);
    wanted = false;
  }
  if (!wanted && header.ttl == 0) return;
  const bool flood = header.ttl != 0 || arrival.channel->ttl_ != 0;
  const bool whole = header.end && header.sequence == 0;
  const Record record = record_of(header, flood, flood || !whole, arrival.moment);
  if (header.ttl != 0) forward(arrival, record);
  if (!wanted) return;
  if (record == Cache::kNone) {
    if (whole) {
      deliver(arrival, fragment.payload, fragment.payload_bytes, fragment.delay);
    } else {
      count(counters_.no_memory);
    }
    return;
  }
  if (cache_.is_delivered(record) || cache_.is_given_up(record)) {
    count(counters_.duplicates);
  } else if (whole && !cache_.is_open(record)) {
    cache_.close_delivered(record, arrival.moment);
    deliver(arrival, fragment.payload, fragment.payload_bytes, fragment.delay);
  } else {
    assemble(arrival, fragment, record);
  }
}

template <class P>
SWARMTALK_HOT typename Swarmtalk<P>::Record Swarmtalk<P>::record_of(const Header& header,
                                                                    bool flood, bool insist,
                                                                    Moment now) {
  Record record = cache_.find(header, now);
  if (record != Cache::kNone) {
    if (cache_.is_open(record) && cache_.is_stale(record, now)) {
      reassembler_.release(record);
      cache_.renew(record, flood, now);
      count(counters_.aged_out);
    }
    return record;
  }
  // While all are open, one that cannot become whole makes place.
  do {
    record = cache_.insert(header, flood, insist, now);
  } while (record == Cache::kNone && give_up_less_than(1, Cache::kNone, now));
  return record;
}

template <class P>
void Swarmtalk<P>::forward(const Arrival& arrival, Record record) {
  if (record == Cache::kNone) {
    count(counters_.no_memory);
    return;
  }
  if (cache_.is_forwarded(record, static_cast<PacketIndex>(arrival.header.sequence))) {
    if (!forward_queue_.is_empty()) forward_queue_.improve(arrival.bytes, arrival.header);
    return;
  }
  if (!forward_queue_.push(arrival.bytes, arrival.size, arrival.header, arrival.now)) {
    count(counters_.forward_queue_full);
    return;
  }
  cache_.set_forwarded(record, static_cast<PacketIndex>(arrival.header.sequence));
  round_robin_.set_ready(0, true);
}

template <class P>
SWARMTALK_HOT void Swarmtalk<P>::assemble(const Arrival& arrival, const Fragment<P>& fragment,
                                          Record record) {
  if (!cache_.is_open(record)) {
    reassembler_.begin(record);
    cache_.open(record, arrival.moment);
  }
  const Ticks elapsed = cache_.since_last_packet(record, arrival.moment);
  Outcome outcome;
  do {
    outcome = reassembler_.add(record, fragment, elapsed);
  } while (outcome == Outcome::kNoSlot &&
           give_up_less_than(worth_with(record, fragment.sequence), record, arrival.moment));
  switch (outcome) {
    case Outcome::kHeld:
      cache_.open(record, arrival.moment);
      break;
    case Outcome::kComplete:
      complete(arrival, fragment, record, elapsed);
      break;
    case Outcome::kDuplicate:
      count(counters_.duplicates);
      break;
    case Outcome::kContradiction:
      give_up(record, arrival.moment);
      count(counters_.contradictions);
      break;
    case Outcome::kNoSlot:
      give_up(record, arrival.moment);
      count(counters_.no_memory);
      break;
  }
}

template <class P>
void Swarmtalk<P>::complete(const Arrival& arrival, const Fragment<P>& fragment, Record record,
                            Ticks elapsed) {
  uint8_t message[W::kMessageBytes];
  typename W::Timestamp delay = 0;
  const uint16_t size = reassembler_.take(record, fragment, elapsed, message, &delay);
  cache_.close_delivered(record, arrival.moment);
  deliver(arrival, message, size, delay);
}

template <class P>
SWARMTALK_HOT void Swarmtalk<P>::deliver(const Arrival& arrival, const uint8_t* bytes,
                                         uint16_t size, typename W::Timestamp delay) {
  const Header& header = arrival.header;
  Reception<P> reception;
  reception.sensing = *arrival.sensing;
  reception.node = header.node;
  reception.epoch = header.epoch;
  reception.message = header.message;
  reception.channel = header.channel;
  reception.ttl = header.ttl;
  reception.hops = hops_of(arrival);
  reception.has_delay = header.timestamped;
  reception.crossed_gateway = header.crossed_gateway;
  reception.delay_ticks = delay;
  count(counters_.messages_received);
  arrival.channel->deliver(bytes, size, reception);
}

template <class P>
uint8_t Swarmtalk<P>::hops_of(const Arrival& arrival) {
  if (P::kHopsBits != 0) return arrival.header.hops;
  const uint8_t sent_ttl = arrival.channel->ttl_;
  return P::kHopsFromTtl && sent_ttl >= arrival.header.ttl
             ? static_cast<uint8_t>(sent_ttl - arrival.header.ttl)
             : kHopsUnknown;
}

template <class P>
void Swarmtalk<P>::give_up(Record record, Moment now) {
  reassembler_.release(record);
  cache_.close_given_up(record, now);
}

template <class P>
uint8_t Swarmtalk<P>::worth(typename Cache::Chance chance, typename W::PacketMask mask) const {
  if (chance == Cache::Chance::kNone ||
      (chance == Cache::Chance::kWithoutGap && Reassembler<P>::has_gap(mask))) {
    return 0;
  }
  return static_cast<uint8_t>(Reassembler<P>::count(mask) + 1);
}

template <class P>
uint8_t Swarmtalk<P>::worth_with(Record record, PacketIndex sequence) const {
  const auto mask = reassembler_.held(record);
  const auto chance = cache_.chance(record);
  return chance == Cache::Chance::kWithoutGap &&
                 Reassembler<P>::has_gap(Reassembler<P>::with(mask, sequence))
             ? uint8_t{0}
             : worth(chance, mask);
}

template <class P>
bool Swarmtalk<P>::give_up_less_than(uint8_t limit, Record kept, Moment now) {
  Record victim = Cache::kNone;
  const Record used = cache_.used();
  for (uint8_t n = 0; n < 32 && n < used; ++n) {
    if (++victim_hand_ >= used) victim_hand_ = 0;
    const auto chance = cache_.chance(victim_hand_);
    if (chance == Cache::Chance::kNotOpen || victim_hand_ == kept) continue;
    if (limit == 1 && chance == Cache::Chance::kAny) continue;
    const uint8_t its_worth = worth(chance, reassembler_.held(victim_hand_));
    if (its_worth < limit) {
      limit = its_worth;
      victim = victim_hand_;
    }
  }
  if (victim == Cache::kNone) return false;
  give_up(victim, now);
  count(counters_.no_memory);
  return true;
}

}  // namespace core
}  // namespace swarmtalk
