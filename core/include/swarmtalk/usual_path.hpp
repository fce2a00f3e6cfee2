// The way of the usual packet: sound, on a channel that this node listens to, of a one-hop message,
// and either that message's only packet or its next one. It does to such a packet exactly what
// receive_path.hpp does, in half as many instructions, and leaves every other packet, untouched, to
// that one. Only in profiles with buckets. Definitions of Swarmtalk's members, included by
// swarmtalk.hpp only.
//
// What is read of a packet stays in registers: no Arrival is handed out by address.
#pragma once

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {
namespace core {

template <class P>
template <bool kQuickly>
SWARMTALK_HOT bool Swarmtalk<P>::receive_usual(const uint8_t* bytes, uint16_t size,
                                               const Sensing& sensing) {
  if (SWARMTALK_SELDOM(size < W::kHeaderBytes)) return false;
  Channel<P>* const to = find_channel_usual(W::ChannelField::get(bytes));
  if (SWARMTALK_SELDOM(to == nullptr || !to->wants(sensing))) return false;
  if (SWARMTALK_SELDOM((W::ttl(bytes) | to->ttl_) != 0)) {
    if (!kQuickly) return false;
    return (knows_next_flood<P>() &&
            receive_next_flood(*computed_once(to), bytes, size, sensing)) ||
           receive_usual_flood(*to, bytes, size, sensing);
  }
  if (SWARMTALK_SELDOM(W::check(bytes, size) != Error::kOk)) return false;
  Arrival arrival;
  arrival.to = to;
  if (SWARMTALK_SELDOM(!read_usual(arrival, bytes, size))) return false;
  if (SWARMTALK_SELDOM(arrival.node == identity_.id())) return false;
  if (!arrival.end || arrival.sequence != 0) {
    return assemble_usual<kQuickly>(arrival, bytes, size, sensing);
  }
  Reception<P> reception;
  W::decode(bytes, reception);
  reception.has_delay = arrival.has_delay;
  reception.delay_ticks = arrival.delay_ticks;
  if (begin_one_hop<kQuickly>(arrival.key, Entry::kDone, false) == nullptr) return false;
  deliver_usual(reception, sensing, *to, bytes + W::kHeaderBytes, arrival.payload_bytes);
  return true;
}

template <class P>
SWARMTALK_HOT bool Swarmtalk<P>::receive_next_flood(Channel<P>& to, const uint8_t* bytes,
                                                    uint16_t size, const Sensing& sensing) {
  if (W::ttl(bytes) != to.ttl_ || !W::is_alone(bytes) || to.timestamped_) return false;
  if (SWARMTALK_SELDOM(W::NodeField::get(bytes) == identity_.id())) return false;
  if (SWARMTALK_SELDOM(W::check(bytes, size) != Error::kOk)) return false;
  Entry* const record = cache_.begin_next_flood(Key(bytes), *this);
  if (SWARMTALK_SELDOM(record == nullptr)) return false;
  cache_.close_flood(*record, queue_forward(bytes, size) ? Mask{1} : Mask{0});
  Reception<P> reception;
  W::decode(bytes, reception);
  reception.sequence = 0;
  reception.end = true;
  reception.has_delay = false;
  reception.delay_ticks = 0;
  deliver_usual(reception, sensing, to, bytes + W::kHeaderBytes,
                static_cast<uint16_t>(size - W::kHeaderBytes - W::kChecksumBytes));
  return true;
}

template <class P>
SWARMTALK_ASIDE bool Swarmtalk<P>::receive_usual_flood(Channel<P>& to, const uint8_t* bytes,
                                                       uint16_t size, const Sensing& sensing) {
  if (W::NodeField::get(bytes) == identity_.id()) return false;
  if (W::SequenceField::get(bytes) != 0 || W::EndField::get(bytes) == 0) return false;
  if (W::check(bytes, size) != Error::kOk) return false;
  Arrival arrival;
  arrival.to = &to;
  if (!read_usual(arrival, bytes, size)) return false;
  if (SWARMTALK_SELDOM(cache_.needs_secret())) draw_secret();
  const uint8_t kind = kind_of(arrival);
  bool is_copy = false;
  Entry* const record = cache_.begin_flood(arrival.key, kind, arrival.bit, is_copy, *this);
  if (record == nullptr || (is_copy && !record->is_done())) return false;
  if (is_copy && (kind & Entry::kDirect) == 0) cache_.hear_copy(*record);
  if (this->is_sent_on(arrival.ttl)) {
    if (P::kLimitsForwarding) {
      forward(arrival, *record);
    } else {
      forward_unlimited(arrival, *record);
    }
  }
  if (is_copy) {
    record->held = static_cast<Mask>(record->held | arrival.bit);
    count(counters_.duplicates);
    return true;
  }
  cache_.close(*record, kAllPackets);
  arrival.sensing = sensing;
  deliver(arrival, arrival.payload, arrival.payload_bytes);
  return true;
}

template <class P>
template <bool kQuickly>
SWARMTALK_HOT typename Swarmtalk<P>::Entry* Swarmtalk<P>::begin_one_hop(const Key& key, uint8_t how,
                                                                        bool insist) {
  if (SWARMTALK_SELDOM(cache_.needs_secret())) draw_secret();
  return cache_.begin_one_hop(key, kQuickly, how, insist, *this);
}

template <class P>
SWARMTALK_HOT bool Swarmtalk<P>::read_usual(Arrival& arrival, const uint8_t* bytes, uint16_t size) {
  arrival.size_bytes = static_cast<PacketSize>(size);
  W::decode(bytes, arrival);
  arrival.key = Key(bytes);
  if (!W::kMarksTimestamps) arrival.has_delay = arrival.to->timestamped_;
  return read_fragment(arrival, bytes);
}

template <class P>
template <bool kQuickly>
SWARMTALK_HOT bool Swarmtalk<P>::assemble_usual(const Arrival& arrival, const uint8_t* bytes,
                                                uint16_t size, const Sensing& sensing) {
  Entry* record = cache_.find_open_one_hop(arrival.key);
  if (SWARMTALK_SELDOM(record == nullptr)) {
    if (arrival.end || !reassembler_.has_slot()) return false;
    record = begin_one_hop<kQuickly>(arrival.key, Entry::kOpen, true);
    if (record == nullptr) return false;
    reassembler_.begin(*record);
  } else if (SWARMTALK_SELDOM(!reassembler_.is_next(*record, arrival))) {
    return false;
  } else if (arrival.end) {
    complete_usual(*arrival.to, bytes, size, sensing, *record);
    return true;
  }
  const Outcome outcome = reassembler_.hold_next(*record, arrival, cache_.age(*record));
  if (SWARMTALK_SELDOM(outcome == Outcome::kNoSlot)) return false;
  cache_.renew_stamp(*record);
  return true;
}

template <class P>
SWARMTALK_ASIDE void Swarmtalk<P>::complete_usual(Channel<P>& to, const uint8_t* bytes,
                                                  uint16_t size, const Sensing& sensing,
                                                  Entry& record) {
  Arrival arrival;
  arrival.to = &to;
  if (!read_usual(arrival, bytes, size)) return;  // it was sound a moment ago
  uint8_t message[W::kMessageBytes];
  const uint16_t message_bytes =
      reassembler_.take_in_order(record, arrival, cache_.age(record), message);
  cache_.close(record, kAllPackets);
  deliver_usual(arrival, sensing, to, message, message_bytes);
}

template <class P>
SWARMTALK_HOT void Swarmtalk<P>::deliver_usual(Reception<P>& reception, const Sensing& sensing,
                                               Channel<P>& to, const uint8_t* bytes,
                                               uint16_t size) {
  reception.sensing = sensing;
  if (P::kHopsBits == 0) reception.hops = P::kHopsFromTtl ? 0 : kHopsUnknown;
  count(counters_.messages_received);
  to.deliver(bytes, size, reception);
}

template <class P>
SWARMTALK_HOT Channel<P>* Swarmtalk<P>::find_channel_usual(ChannelId id) {
  Channel<P>* const channel = this->hinted(id);
  if (this->kIsSure || (channel != nullptr && channel->id() == id)) return channel;
  return find_channel(id);
}

}  // namespace core
}  // namespace swarmtalk
