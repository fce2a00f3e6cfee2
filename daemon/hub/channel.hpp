// Channel: one channel in use, as the hub's parts share it: its subscriptions, and on each station
// what is in flight and what waits. Made by ChannelRegistry; Outbox fills and empties the slots.
#pragma once

#include <cstdint>
#include <vector>

#include "daemon/hub/hub_client.hpp"
#include "daemon/message/loss.hpp"

namespace swarmtalk::daemon {

struct Publication;

/// What every station that carries a channel can do on it.
struct ChannelLimits {
  std::uint16_t message_bytes = 0;
  std::uint8_t ttl = 0;
  std::uint16_t least_message_bytes = 0;
  bool is_timestamped = false;
  bool has_redundancy = false;  // on one of them at least
};

/// One channel on one station.
struct Slot {
  Publication* in_flight = nullptr;
  std::vector<Publication*> waiting;  // first come, first sent
  bool is_open = false;
  std::uint32_t copies_left = 0;   // of the one in flight
  bool is_between_copies = false;  // it waits for its next copy's time: its node must not forget it
  bool has_left = false;           // a copy of it has
  bool is_gateway = false;         // heard for a gateway rule, whoever subscribes
};

struct Channel {
  std::uint16_t number = 0;
  bool is_timestamped = false;
  std::uint32_t publishers = 0;
  std::uint32_t publications = 0;  // not yet sent everywhere
  std::vector<Subscription*> subscriptions;
  std::vector<Slot> slots;     // one for each station
  ChannelLimits limits;        // of the stations that carry it
  std::uint64_t received = 0;  // from stations, for a subscription
  Loss lost;
  std::uint64_t refused = 0;          // messages of programs here that were not taken
  std::uint32_t last_air_number = 0;  // of a publication on several links
  std::uint64_t last_used = 0;        // ChannelRegistry::touch()
  bool is_pinned = false;             // of a gateway rule: never evicted

  bool is_idle() const { return publishers == 0 && publications == 0 && subscriptions.empty(); }
  bool has_users() const { return publishers > 0 || !subscriptions.empty(); }
};

}  // namespace swarmtalk::daemon
