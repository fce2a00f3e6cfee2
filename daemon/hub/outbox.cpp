#include "daemon/hub/outbox.hpp"

#include <algorithm>
#include <chrono>
#include <vector>

#include "daemon/common/logging.hpp"
#include "daemon/common/monotonic_ns.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

/// Of the client that it is of. Null: it is gone, or there never was one.
Share* owners_share(const Publication& publication) {
  const bool has_client = publication.owner != nullptr && publication.owner->client != nullptr;
  return has_client ? &publication.owner->client->share : nullptr;
}

void take_share(const Publication& publication, Share* share) {
  if (share == nullptr) return;
  ++share->waiting_messages;
  share->waiting_bytes += publication.payload.size();
}

void give_back_share(const Publication& publication, Share* share) {
  if (share == nullptr) return;
  --share->waiting_messages;
  share->waiting_bytes -= publication.payload.size();
}

}  // namespace

void Outbox::publish(Publisher& publisher, Channel& channel, std::uint64_t number,
                     std::string_view payload, std::uint8_t ttl,
                     std::optional<std::uint64_t> sent_at_ns) {
  if (publisher.in_flight != nullptr && publisher.queue.size() >= publisher.queue_limit) {
    drop_oldest(publisher, channel);
  }
  Publication& publication = pool_.take();
  publication.owner = &publisher;
  publication.client = publisher.client->serial();
  publication.user = publisher.client->share.user;
  publication.number = number;
  publication.payload.assign(payload);
  publication.ttl = ttl;
  if (channel.is_timestamped) publication.sent_at_ns = sent_at_ns.value_or(monotonic_ns());
  publication.copies = publisher.copies;
  publication.copy_interval_ms = publisher.copy_interval_ms;
  publication.redundancy = publisher.redundancy;
  ++counters_.messages_published;
  take_on(publication, channel);
  if (publisher.in_flight != nullptr) {
    publisher.queue.push_back(&publication);
  } else {
    start(publication, channel);
  }
}

void Outbox::copy(const GatewayRule& rule, Channel& channel, std::span<const std::uint8_t> payload,
                  GatewayOrigin origin, std::uint8_t ttl) {
  make_room(rule, channel);
  Publication& publication = pool_.take();
  publication.payload.assign(payload.begin(), payload.end());
  publication.ttl = ttl;
  publication.rule = &rule;
  publication.sent_at_ns = monotonic_ns();
  publication.origin = std::move(origin);
  publication.pending = 1;
  publication.is_heard_locally = rule.from_channel == rule.to_channel;  // as the original
  take_on(publication, channel);
  channel.slots[rule.to_link].waiting.push_back(&publication);
  feed(rule.to_link, channel);
}

void Outbox::take_on(Publication& publication, Channel& channel) {
  ++channel.publications;
  channels_.touch(channel);
  waiting_bytes_ += publication.payload.size();
  take_share(publication, owners_share(publication));
  take_share(publication, publication.user);
  if (waiting_++ == 0) waiting_hook_();
}

// The opposite.
void Outbox::settle(Publication& publication, Channel& channel) {
  --channel.publications;
  --waiting_;
  waiting_bytes_ -= publication.payload.size();
  give_back_share(publication, owners_share(publication));
  give_back_share(publication, publication.user);
}

// Between two copies it takes nobody else's room.
void Outbox::park(Publication& publication) {
  if (publication.parked++ == 0) ++parked_;
}

void Outbox::unpark(Slot& slot) {
  if (!std::exchange(slot.is_between_copies, false)) return;
  if (--slot.in_flight->parked == 0) --parked_;
}

void Outbox::withdraw(Publisher& publisher) {
  if (publisher.in_flight == nullptr) return;
  Publisher& heir = departed_.emplace_back();
  heir.in_flight = std::exchange(publisher.in_flight, nullptr);
  heir.queue = std::exchange(publisher.queue, {});
  const auto inherit = [&](Publication& publication) {
    give_back_share(publication, owners_share(publication));  // its user's share keeps it
    publication.owner = &heir;
  };
  inherit(*heir.in_flight);
  for (Publication* waiting : heir.queue) inherit(*waiting);
}

void Outbox::forget_departed(const Publisher& heir) {
  if (heir.in_flight != nullptr || heir.is_starting_next) return;
  departed_.remove_if([&](const Publisher& each) { return &each == &heir; });
}

// Hands a publication to every station that can carry it. Its publisher has none in flight.
void Outbox::start(Publication& publication, Channel& channel) {
  publication.owner->in_flight = &publication;
  // Copies of a gateway take numbers on one link only: there each link counts by itself.
  if (stations_.size() > 1 && !channel.is_pinned) {
    publication.air_number = ++channel.last_air_number;
  }
  ++publication.pending;  // ours, so that it is not finished before all stations have it
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (!channels_.carries(i, channel, publication.payload.size())) continue;
    ++publication.pending;
    channel.slots[i].waiting.push_back(&publication);
    feed(i, channel);
  }
  finish(publication, channel, false);
}

// A publication that fails at once calls finish(), and that would come back here: once is enough.
void Outbox::start_next(Publisher& publisher, Channel& channel) {
  if (std::exchange(publisher.is_starting_next, true)) return;
  while (publisher.in_flight == nullptr && !publisher.queue.empty()) {
    Publication& next = *publisher.queue.front();
    publisher.queue.pop_front();
    start(next, channel);
  }
  publisher.is_starting_next = false;
}

void Outbox::drop_oldest(Publisher& publisher, Channel& channel) {
  Publication& oldest = *publisher.queue.front();
  publisher.queue.pop_front();
  ++counters_.messages_dropped_queue;
  publisher.client->on_unsent(
      publisher.id, oldest.number,
      {ipc::ERROR_DROPPED, "a newer message of this publisher took its place in the queue",
       std::nullopt});
  settle(oldest, channel);
  pool_.give_back(oldest);
}

// Of the copies that wait for a slow link the newest are worth most.
void Outbox::make_room(const GatewayRule& rule, Channel& channel) {
  auto& waiting = channel.slots[rule.to_link].waiting;
  const auto is_copy = [&](const Publication* each) { return each->rule == &rule; };
  const auto copies = std::count_if(waiting.begin(), waiting.end(), is_copy);
  if (static_cast<std::uint32_t>(copies) < rule.queue_messages) return;
  const auto oldest = std::find_if(waiting.begin(), waiting.end(), is_copy);
  Publication& dropped = **oldest;
  waiting.erase(oldest);
  dropped.is_replaced = true;
  finish(dropped, channel, false);
}

// Starts the next message of a channel on a station, if none is in flight there.
void Outbox::feed(std::size_t station, Channel& channel) {
  Slot& slot = channel.slots[station];
  while (slot.in_flight == nullptr && !slot.waiting.empty()) {
    Publication& next = *slot.waiting.front();
    std::uint32_t number = next.air_number;
    const std::uint64_t waited_us = channel.is_timestamped ? next.waited_us(monotonic_ns()) : 0;
    const GatewayOrigin* const origin = next.origin ? &*next.origin : nullptr;
    if (next.redundancy != 0) stations_[station].protect_next(next.redundancy);
    const SendResult result =
        stations_[station].send(channel.number, next.bytes(), next.ttl, origin, waited_us, number);
    if (result == SendResult::kBusy) return;
    slot.waiting.erase(slot.waiting.begin());
    if (result == SendResult::kRefused) {
      finish(next, channel, false);
      continue;
    }
    if (next.air_number != 0) {  // a link may be ahead: the others follow
      next.air_number = std::max(next.air_number, number);
      channel.last_air_number = std::max(channel.last_air_number, number);
    }
    slot.in_flight = &next;
    slot.copies_left = next.copies - 1;
    slot.has_left = false;
    if (std::exchange(next.is_heard_locally, true)) continue;
    listener_.on_outgoing(next, station, channel, number);
  }
}

void Outbox::on_sent(std::size_t station, std::uint16_t channel_number) {
  Channel* const channel = channels_.find(channel_number);
  if (channel == nullptr) return;
  Slot& slot = channel->slots[station];
  if (wait_for_copy(station, *channel, slot)) return;
  if (Publication* sent = std::exchange(slot.in_flight, nullptr)) {
    if (sent->copies > 1) channels_.listen(*channel);  // nobody may be left of who did
    finish(*sent, *channel, true);
  }
  feed(station, *channel);
}

// A message of several copies keeps its place until the last has left. @return whether it does
bool Outbox::wait_for_copy(std::size_t station, Channel& channel, Slot& slot) {
  if (slot.in_flight == nullptr) return false;
  slot.has_left = true;
  if (slot.copies_left == 0) return false;
  --slot.copies_left;
  slot.is_between_copies = true;
  park(*slot.in_flight);
  const Time at = loop::now() + std::chrono::milliseconds(slot.in_flight->copy_interval_ms);
  copies_.add({at, channel.number, station, slot.in_flight->serial});
  return true;
}

void Outbox::send_copies(Time now) {
  for (const CopySchedule::Due& copy : copies_.take(now)) {
    Channel* const channel = channels_.find(copy.channel);
    if (channel == nullptr) continue;
    Slot& slot = channel->slots[copy.station];
    if (slot.in_flight == nullptr || slot.in_flight->serial != copy.publication) continue;
    unpark(slot);
    ++counters_.copies_sent;
    if (stations_[copy.station].send_again(copy.channel)) continue;
    slot.copies_left = 0;
    on_sent(copy.station, copy.channel);
  }
  copies_.tell_next();
}

// One station is done with a publication; the last one tells the client and frees it.
void Outbox::finish(Publication& publication, Channel& channel, bool was_sent) {
  if (was_sent) ++publication.sent;
  if (--publication.pending > 0) return;
  settle(publication, channel);
  Publisher* const owner = publication.owner;
  HubClient* const client = owner == nullptr ? nullptr : owner->client;
  if (owner != nullptr) owner->in_flight = nullptr;
  if (publication.rule != nullptr) {
    count_copy(publication);
  } else if (publication.sent > 0) {
    ++counters_.messages_sent;
    if (client != nullptr) client->on_sent(*owner, publication.number);
  } else {
    ++counters_.messages_link_down;
    if (client == nullptr) ++given_up_;
    if (!publication.is_heard_locally) listener_.on_stayed_here(publication, channel);
    if (client != nullptr) {
      client->on_unsent(
          owner->id, publication.number,
          {ipc::ERROR_LINK_DOWN,
           "the link went down before the message could leave, so only programs of this "
           "robot heard it; for the others publish again when it is up "
           "(`swarmtalk-cli status`)",
           std::nullopt});
    }
  }
  pool_.give_back(publication);
  if (owner == nullptr) return;
  start_next(*owner, channel);
  if (client == nullptr) forget_departed(*owner);
}

void Outbox::count_copy(const Publication& publication) {
  if (publication.sent > 0) {
    ++counters_.gateway_sent;
  } else if (publication.is_replaced) {
    ++counters_.gateway_full;
  } else {
    ++counters_.gateway_link_down;
  }
}

bool Outbox::give_up_on_dead_links() {
  if (waiting_ == 0) return false;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (stations_[i].is_up()) continue;
    for (auto& [number, channel] : channels_.all()) {
      if (!channel.slots[i].is_open) continue;
      Slot& slot = channel.slots[i];
      stations_[i].cancel(number);
      const bool was_between_copies = slot.is_between_copies;
      unpark(slot);
      if (was_between_copies) channels_.listen(channel);
      const std::vector<Publication*> waiting = std::exchange(slot.waiting, {});
      const bool has_left = slot.has_left;
      if (Publication* dead = std::exchange(slot.in_flight, nullptr)) {
        finish(*dead, channel, has_left);
      }
      for (Publication* dead : waiting) finish(*dead, channel, false);
    }
  }
  if (const std::uint32_t count = std::exchange(given_up_, 0)) {
    log_of("hub")->warn("no link is up; messages of programs that have ended and are given up: {}",
                        count);
  }
  return waiting_ > 0;
}

}  // namespace swarmtalk::daemon
