// What a node counts: everything it drops, by cause, and what went well, to compare with.
#pragma once

#include "swarmtalk/profile.hpp"

namespace swarmtalk {
namespace core {

/// Each counter stays at its largest value instead of wrapping.
template <class P>
struct Counters {
  using Counter = typename P::Counter;
  Counter packets_received = 0;   // handed to on_packet, good or bad
  Counter packets_sent = 0;       // pulled, forwarded ones included
  Counter packets_forwarded = 0;  // pulled for another node
  Counter messages_sent = 0;      // last packet pulled
  Counter messages_received = 0;  // complete and handed to at least one subscriber
  // Dropped packets:
  Counter bad_packets = 0;  // impossible length or contradiction in the header
  Counter bad_checksums = 0;
  Counter unknown_channels = 0;    // no subscriber here (it may have been forwarded all the same)
  Counter too_far = 0;             // beyond every subscriber's distance (dito)
  Counter duplicates = 0;          // copies of something delivered, held or given up
  Counter own_echoes = 0;          // our own packets, sent on by others
  Counter forward_queue_full = 0;  // not forwarded for want of a slot
  // Dropped messages, with the packets held of them:
  Counter no_memory = 0;       // no room to begin or to go on
  Counter aged_out = 0;        // no further packet for kAssemblyTicks
  Counter contradictions = 0;  // packets that cannot be of one message: two senders with one id
  // Node ids:
  Counter id_collisions = 0;  // packets of somebody else under our id
  Counter id_changes = 0;
};

template <class Counter>
inline void count(Counter& counter) {
  const Counter next = static_cast<Counter>(counter + 1);
  if (next != 0) counter = next;
}

}  // namespace core
}  // namespace swarmtalk
