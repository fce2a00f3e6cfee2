// What a packet of another node goes through on its way on: queued once, within the limits that
// were set, given up when it has waited for too long, pulled. Definitions of Swarmtalk's members,
// included by swarmtalk.hpp only.
#pragma once

#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {
namespace core {

template <class P>
void Swarmtalk<P>::forward(const Arrival& arrival, Entry& record) {
  if (this->allowed_ttl(arrival.ttl) == arrival.ttl) return forward_unlimited(arrival, record);
  Arrival limited = arrival;
  limited.ttl = this->allowed_ttl(arrival.ttl);
  forward_unlimited(limited, record);
}

template <class P>
void Swarmtalk<P>::forward_unlimited(const Arrival& arrival, Entry& record) {
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
inline void Swarmtalk<P>::drop_late_forwards() {
  if (this->max_wait() == 0 || forward_queue_.is_empty()) return;
  const auto dropped = forward_queue_.drop_older_than(
      static_cast<typename W::WaitTicks>(this->max_wait()), wait_now());
  if (dropped == 0) return;
  this->count_too_late(dropped);
  note_forwards();
}

template <class P>
inline typename Swarmtalk<P>::PacketSize Swarmtalk<P>::pull_forwarded(typename W::WaitTicks now,
                                                                      uint8_t* out) {
  const uint8_t* packet = forward_queue_.next();
  bool timestamped = W::is_timestamped(packet);
  if (!W::kMarksTimestamps) {
    const Channel<P>* channel = find_channel(W::ChannelField::get(packet));
    timestamped = channel != nullptr && channel->timestamped_;
    // It may have come before the channel was opened like this, without room for a timestamp.
    if (!P::kPadded &&
        forward_queue_.next_bytes() < W::kHeaderBytes + W::kTimestampBytes + W::kChecksumBytes) {
      timestamped = false;
    }
  }
  const PacketSize size = forward_queue_.pull(timestamped, now, out);
  note_forwards();
  count(counters_.packets_forwarded);
  return size;
}

template <class P>
SWARMTALK_AVR_INLINED void Swarmtalk<P>::note_forwards() {
  if (P::kBuckets != 0) cache_.set_waiting(forward_queue_.size());
  if (forward_queue_.is_empty()) round_robin_.set_ready(0, false);
}

}  // namespace core
}  // namespace swarmtalk
