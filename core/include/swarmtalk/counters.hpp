// What a node counts: what it drops, by cause, and what went well, to compare with. Not counted is
// what a pause ends that is longer than messages are remembered (DuplicateCache::has_ended).
#pragma once

#include <string.h>

#include "swarmtalk/profile.hpp"
#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

/// Each counter stays at its largest value instead of wrapping.
template <class P>
struct Counters {
  using Counter = typename P::Counter;
  SWARMTALK_PART(Counters)
  void start() { set_zero(*this); }
  Counter packets_received;   // handed to on_packet, good or bad
  Counter packets_sent;       // pulled, forwarded ones included
  Counter packets_forwarded;  // pulled for another node
  Counter messages_sent;      // last packet pulled
  Counter messages_received;  // complete and handed to at least one subscriber
  // Dropped packets:
  Counter bad_packets;  // impossible length or contradiction in the header
  Counter bad_checksums;
  Counter unknown_channels;    // no subscriber here (it may have been forwarded all the same)
  Counter too_far;             // beyond every subscriber's distance (may have been forwarded)
  Counter duplicates;          // of something delivered, held or given up: copies, and late packets
  Counter own_echoes;          // our own packets, sent on by others
  Counter forward_queue_full;  // no slot was free: it, or one that waited there, is not sent on
  // Dropped messages, with the packets held of them:
  Counter no_memory;       // no room to begin or to go on, or so it looked (Forecast)
  Counter aged_out;        // not whole when its time was over, or its number came again
  Counter contradictions;  // packets that cannot be of one message: two senders with one id
  // Node ids:
  Counter id_collisions;  // packets of somebody else under our id
  Counter id_changes;

  /// One more. @param counter  of this object
  SWARMTALK_AVR_INLINED void count(Counter& counter) {
#ifdef __AVR__  // one register to set at each call
    count_at(static_cast<uint8_t>(&counter - first()));
#else
    count_up(counter);
#endif
  }

 private:
  SWARMTALK_AVR_CALLED void count_at(uint8_t place) {
    count_up(first()[place]);
  }
  Counter* first() {
    return reinterpret_cast<Counter*>(this);
  }
  static SWARMTALK_AVR_INLINED void count_up(Counter& counter) {
    const Counter next = static_cast<Counter>(counter + 1);
    if (next != 0) counter = next;
  }
};

}  // namespace core
}  // namespace swarmtalk
