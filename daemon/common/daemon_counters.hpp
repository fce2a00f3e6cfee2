// What the daemon itself counts, beside its links and nodes. One struct, so that a name is spelled
// in one place; docs/operations.md says what each means. Incremented on the daemon's one thread.
#pragma once

#include <cstdint>

#include "drivers/link/link.hpp"

namespace swarmtalk::daemon {

struct DaemonCounters {
  std::uint64_t clients_accepted = 0;
  std::uint64_t clients_refused = 0;          // over limits.clients
  std::uint64_t clients_malformed = 0;        // closed: bytes that are not a legal request
  std::uint64_t clients_other_version = 0;    // closed: another protocol major
  std::uint64_t clients_silent = 0;           // closed: no Hello in time
  std::uint64_t clients_not_reading = 0;      // read no further: replies piled up
  std::uint64_t requests_refused = 0;         // answered with a Failure, publications included
  std::uint64_t requests_too_fast = 0;        // refused: over a rate of a client or a user
  std::uint64_t shares_refused = 0;           // subscriptions, publishers: over a client's, user's
  std::uint64_t messages_over_share = 0;      // refused: too many wait, of a client, a user or all
  std::uint64_t messages_published = 0;       // accepted from clients
  std::uint64_t messages_sent = 0;            // ... whose last packet has left
  std::uint64_t messages_busy = 0;            // refused: the publisher's previous one waits
  std::uint64_t messages_busy_in_client = 0;  // refused by programs themselves, as they say
  std::uint64_t messages_link_down = 0;       // refused or given up: no link up
  std::uint64_t messages_over_mtu = 0;        // refused: an interface's MTU is too small
  std::uint64_t messages_dropped_queue = 0;   // by a newer one, from their publisher's queue
  std::uint64_t messages_too_fast = 0;        // refused: over limits.publish_rate_hz
  std::uint64_t reports_sent = 0;             // of this robot, while somebody looks
  std::uint64_t reports_received = 0;
  std::uint64_t reports_unreadable = 0;  // damaged, of another version, or forwarded
  std::uint64_t pings_answered = 0;
  std::uint64_t pings_unanswered = 0;      // too many, or no link could take the answer
  std::uint64_t reserved_too_fast = 0;     // refused: over reserved.rate_hz
  std::uint64_t copies_sent = 0;           // repeats of important messages
  std::uint64_t messages_received = 0;     // whole messages from links, for a local subscription
  std::uint64_t messages_lost_air = 0;     // gaps in a sender's numbers that nothing else explains
  std::uint64_t messages_lost_kernel = 0;  // gaps put down to drops of the kernel
  std::uint64_t messages_lost_memory = 0;  // gaps put down to a node's want of memory
  std::uint64_t numbers_not_believed = 0;  // of messages: more are missing than can have been sent
  std::uint64_t beacons_not_believed = 0;  // tell of more messages than their sender can have sent
  std::uint64_t messages_late = 0;         // counted as lost in the air or kernel, came after all
  std::uint64_t deliveries_queued = 0;     // one for each subscription that a message goes to
  std::uint64_t deliveries_sent = 0;       // written to clients
  std::uint64_t deliveries_too_far = 0;    // beyond a subscription's max_distance
  std::uint64_t deliveries_unknown_distance = 0;  // dropped by drop_unknown_distance
  std::uint64_t deliveries_dropped_full = 0;      // the oldest, when keep_last were waiting
  std::uint64_t deliveries_dropped_bytes = 0;     // for limits.queue_bytes
  std::uint64_t deliveries_dropped_old = 0;       // for a subscription's max_age
  std::uint64_t deliveries_dropped_closed = 0;    // waited for a client that went away
  std::uint64_t deliveries_lost_in_client = 0;    // dropped by a client's own queue, as it says
  std::uint64_t duplicate_node_ids = 0;           // frames of another transmitter under our id
  std::uint64_t node_id_changes = 0;
  std::uint64_t duplicate_neighbours = 0;  // pairs of other robots heard under one id
  std::uint64_t poses_received = 0;        // over the pose socket
  std::uint64_t poses_refused = 0;         // datagrams there that are not a pose
  std::uint64_t link_duplicates = 0;       // messages that had come over another link already
  std::uint64_t gateway_sent = 0;          // copies that have left
  std::uint64_t gateway_crossed = 0;       // not copied: had crossed a gateway already
  std::uint64_t gateway_there = 0;         // not copied: another gateway's copy was heard there
  std::uint64_t gateway_full = 0;          // oldest waiting copy dropped for a newer one
  std::uint64_t gateway_too_long = 0;      // not copied: longer than the other link carries
  std::uint64_t gateway_empty = 0;      // not copied: of 0 bytes, which the other link cannot carry
  std::uint64_t gateway_link_down = 0;  // not copied, or given up: the other link is down

  drivers::Counters list() const;
};

}  // namespace swarmtalk::daemon
