// The hub's channels and the ways between sessions and stations. What is decided before a message
// is accepted is in hub_admission.cpp.
#include "daemon/hub/hub.hpp"

#include <algorithm>
#include <chrono>

#include "daemon/common/logging.hpp"
#include "daemon/common/monotonic_ns.hpp"

namespace swarmtalk::daemon {
namespace {

/// The client says when it sent it; a time to come counts as now.
std::uint64_t waited_us_of(const Publication& publication) {
  const std::uint64_t now_ns = monotonic_ns();
  return (now_ns - std::min(now_ns, publication.sent_at_ns)) / 1000;
}

}  // namespace

Hub::Hub(ChannelTable& names, const LimitsConfig& limits, DaemonCounters& counters,
         NodeIdentity& identity)
    : names_(names),
      limits_(limits),
      counters_(counters),
      identity_(identity),
      losses_(limits.tracked_senders) {}

Hub::~Hub() = default;

void Hub::add(Station& station) {
  stations_.push_back(&station);
  station_drops_.emplace_back();
}

std::optional<Refusal> Hub::subscribe(const ChannelRequest& request, Subscription& subscription) {
  Channel* channel = nullptr;
  if (auto refusal = use(request, subscription.held_name, channel)) return refusal;
  subscription.channel = channel->number;
  channel->subscriptions.push_back(&subscription);
  if (channel->subscriptions.size() == 1) listen(*channel);
  return std::nullopt;
}

void Hub::unsubscribe(Subscription& subscription) {
  Channel& channel = *find(subscription.channel);
  std::erase(channel.subscriptions, &subscription);
  names_.release(channel.number, subscription.held_name);
  if (!channel.subscriptions.empty()) return;
  losses_.forget(channel.number);
  listen(channel);
}

void Hub::listen(Channel& channel) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    const Slot& slot = channel.slots[i];
    if (!slot.is_open) continue;
    stations_[i]->set_listening(channel.number, slot.is_gateway || !channel.subscriptions.empty());
  }
}

std::optional<Refusal> Hub::advertise(const ChannelRequest& request, Publisher& publisher) {
  std::uint16_t number = 0;
  if (auto refusal = resolve(request, number)) return refusal;
  if (auto refusal = check_reserved(number)) return refusal;
  if (auto refusal = check_ttl(request.ttl, limits(number))) return refusal;
  publisher.ttl = static_cast<std::uint8_t>(request.ttl);
  Channel* channel = nullptr;
  if (auto refusal = use(request, publisher.held_name, channel)) return refusal;
  publisher.channel = channel->number;
  ++channel->publishers;
  return std::nullopt;
}

void Hub::unadvertise(Publisher& publisher) {
  Channel& channel = *find(publisher.channel);
  --channel.publishers;
  names_.release(channel.number, publisher.held_name);
  while (!publisher.queue.empty()) {
    Publication& dropped = *publisher.queue.front();
    publisher.queue.pop_front();
    ++counters_.messages_dropped_closed;
    drop_queued(publisher, channel, dropped);
  }
  if (publisher.in_flight == nullptr) return;
  publisher.in_flight->owner = nullptr;
  publisher.in_flight = nullptr;
}

std::optional<Refusal> Hub::publish(Publisher& publisher, std::uint64_t number,
                                    std::string_view payload, std::optional<std::uint32_t> ttl,
                                    std::optional<std::uint64_t> sent_at_ns) {
  Channel& channel = *find(publisher.channel);
  const std::uint32_t hops = ttl.value_or(publisher.ttl);
  if (auto refusal = check(publisher, channel, payload.size(), hops)) return refusal;
  if (auto refusal = take_turn(channel.number)) return refusal;
  if (publisher.in_flight != nullptr && publisher.queue.size() >= publisher.queue_limit) {
    Publication& oldest = *publisher.queue.front();
    publisher.queue.pop_front();
    ++counters_.messages_dropped_queue;
    publisher.client->on_unsent(
        publisher.id, oldest.number,
        {ipc::ERROR_DROPPED, "a newer message of this publisher took its place in the queue",
         std::nullopt});
    drop_queued(publisher, channel, oldest);
  }
  Publication& publication = new_publication();
  publication.owner = &publisher;
  publication.client = publisher.client->serial();
  publication.number = number;
  publication.payload.assign(payload);
  publication.ttl = static_cast<std::uint8_t>(hops);
  if (channel.is_timestamped) publication.sent_at_ns = sent_at_ns.value_or(monotonic_ns());
  publication.copies = publisher.copies;
  publication.copy_interval_ms = publisher.copy_interval_ms;
  ++counters_.messages_published;
  ++channel.publications;
  channel.last_used = ++use_count_;
  if (waiting_++ == 0) waiting_hook_();
  if (publisher.in_flight != nullptr) {
    publisher.queue.push_back(&publication);
  } else {
    start(publication, channel);
  }
  return std::nullopt;
}

// Hands a publication to every station that can carry it. Its publisher has none in flight.
void Hub::start(Publication& publication, Channel& channel) {
  publication.owner->in_flight = &publication;
  // Copies of a gateway take numbers on one link only: there each link counts by itself.
  if (stations_.size() > 1 && !channel.is_pinned) {
    publication.air_number = ++channel.last_air_number;
  }
  ++publication.pending;  // ours, so that it is not finished before all stations have it
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (!carries(i, channel, publication.payload.size())) continue;
    ++publication.pending;
    channel.slots[i].waiting.push_back(&publication);
    feed(i, channel);
  }
  finish(publication, channel, false);
}

// A publication that fails at once calls finish(), and that would come back here: once is enough.
void Hub::start_next(Publisher& publisher, Channel& channel) {
  if (std::exchange(publisher.is_starting_next, true)) return;
  while (publisher.in_flight == nullptr && !publisher.queue.empty()) {
    Publication& next = *publisher.queue.front();
    publisher.queue.pop_front();
    start(next, channel);
  }
  publisher.is_starting_next = false;
}

// It has left its publisher's queue and will never start.
void Hub::drop_queued(Publisher&, Channel& channel, Publication& publication) {
  --channel.publications;
  --waiting_;
  free_publications_.push_back(&publication);
}

// Starts the next message of a channel on a station, if none is in flight there.
void Hub::feed(std::size_t station, Channel& channel) {
  Slot& slot = channel.slots[station];
  while (slot.in_flight == nullptr && !slot.waiting.empty()) {
    Publication& next = *slot.waiting.front();
    std::uint32_t number = next.air_number;
    const std::span<const std::uint8_t> payload(
        reinterpret_cast<const std::uint8_t*>(next.payload.data()), next.payload.size());
    const std::uint64_t waited_us = channel.is_timestamped ? waited_us_of(next) : 0;
    const GatewayOrigin* const origin = next.origin ? &*next.origin : nullptr;
    const SendResult result =
        stations_[station]->send(channel.number, payload, next.ttl, origin, waited_us, number);
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
    slot.is_between_copies = false;
    slot.has_left = false;
    deliver_locally(next, station, channel, number);
  }
}

void Hub::on_sent(Station& station, std::uint16_t channel_number) {
  Channel* const channel = find(channel_number);
  if (channel == nullptr) return;
  const std::size_t index = index_of(station);
  Slot& slot = channel->slots[index];
  if (wait_for_copy(index, *channel, slot)) return;
  if (Publication* sent = std::exchange(slot.in_flight, nullptr)) finish(*sent, *channel, true);
  feed(index, *channel);
}

// A message of several copies keeps its place until the last has left. @return whether it does
bool Hub::wait_for_copy(std::size_t station, Channel& channel, Slot& slot) {
  if (slot.in_flight == nullptr) return false;
  slot.has_left = true;
  if (slot.copies_left == 0) return false;
  --slot.copies_left;
  slot.is_between_copies = true;
  const Time at = std::chrono::steady_clock::now() +
                  std::chrono::milliseconds(slot.in_flight->copy_interval_ms);
  const bool is_first = std::all_of(due_copies_.begin(), due_copies_.end(),
                                    [at](const DueCopy& other) { return at < other.at; });
  due_copies_.push_back({at, channel.number, station, slot.in_flight->serial});
  if (is_first) copy_hook_(at);
  return true;
}

void Hub::send_copies(Time now) {
  std::vector<DueCopy> due;
  std::erase_if(due_copies_, [&](const DueCopy& copy) {
    if (copy.at <= now) due.push_back(copy);
    return copy.at <= now;
  });
  for (const DueCopy& copy : due) {
    Channel* const channel = find(copy.channel);
    if (channel == nullptr) continue;
    Slot& slot = channel->slots[copy.station];
    if (slot.in_flight == nullptr || slot.in_flight->serial != copy.publication) continue;
    slot.is_between_copies = false;
    ++counters_.copies_sent;
    if (stations_[copy.station]->send_again(copy.channel)) continue;
    slot.copies_left = 0;
    on_sent(*stations_[copy.station], copy.channel);
  }
  const auto next = std::min_element(due_copies_.begin(), due_copies_.end(),
                                     [](const auto& a, const auto& b) { return a.at < b.at; });
  if (next != due_copies_.end()) copy_hook_(next->at);
}

// One station is done with a publication; the last one tells the client and frees it.
void Hub::finish(Publication& publication, Channel& channel, bool was_sent) {
  if (was_sent) ++publication.sent;
  if (--publication.pending > 0) return;
  --channel.publications;
  --waiting_;
  Publisher* owner = publication.owner;
  if (owner != nullptr) owner->in_flight = nullptr;
  if (publication.rule != nullptr) {
    count_copy(publication);
  } else if (publication.sent > 0) {
    ++counters_.messages_sent;
    if (owner != nullptr) owner->client->on_sent(*owner, publication.number);
  } else {
    ++counters_.messages_link_down;
    if (owner != nullptr) {
      owner->client->on_unsent(owner->id, publication.number,
                               {ipc::ERROR_LINK_DOWN,
                                "the link went down before the message could leave; publish again "
                                "when it is up (`swarmtalk-cli status`)",
                                std::nullopt});
    }
  }
  free_publications_.push_back(&publication);
  if (owner != nullptr) start_next(*owner, channel);
}

bool Hub::give_up_on_dead_links() {
  if (waiting_ == 0) return false;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (stations_[i]->is_up()) continue;
    for (auto& [number, channel] : channels_) {
      if (!channel.slots[i].is_open) continue;
      Slot& slot = channel.slots[i];
      stations_[i]->cancel(number);
      const std::vector<Publication*> waiting = std::exchange(slot.waiting, {});
      const bool has_left = slot.has_left;
      if (Publication* dead = std::exchange(slot.in_flight, nullptr)) {
        finish(*dead, channel, has_left);
      }
      for (Publication* dead : waiting) finish(*dead, channel, false);
    }
  }
  return waiting_ > 0;
}

void Hub::deliver_locally(Publication& publication, std::size_t station, Channel& channel,
                          std::uint32_t number) {
  if (std::exchange(publication.is_heard_locally, true)) return;
  if (publication.rule == nullptr && !rules_.empty()) cross_own(publication, channel, number);
  const auto is_other = [&](const Subscription* s) {
    return s->client->serial() != publication.client;
  };
  if (std::none_of(channel.subscriptions.begin(), channel.subscriptions.end(), is_other)) return;
  MessageRef message = pool_.take();
  message->payload.assign(publication.payload);
  message->channel = channel.number;
  message->sender = stations_[station]->identity().id();
  message->epoch = identity_.epoch() & 0xFFFFu;  // as a packet carries it
  message->number = number;
  message->distance_m = 0.0f;
  message->bearing_rad = std::numeric_limits<float>::quiet_NaN();
  message->sender_pose.reset();
  message->hops = 0;
  message->ttl = publication.ttl;
  message->buffering_delay_us.reset();
  message->received_at_ns = monotonic_ns();
  message->is_time_known = true;
  if (channel.is_timestamped) {
    message->buffering_delay_us =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(waited_us_of(publication), UINT32_MAX));
  }
  message->is_local = true;
  message->crossed_gateway = publication.rule != nullptr;
  message->origin = publication.origin;
  deliver(channel, message, publication.client);
}

void Hub::note_losses(Channel& channel, const Station& station, const MessageHead& head) {
  note_drops(station, head.drops);
  add_loss(channel, losses_.note({head.channel, head.sender, head.epoch}, head.number, drops_));
}

// What the station has dropped since it was asked last joins the sums.
void Hub::note_drops(const Station& station, const DropTotals& drops) {
  DropTotals& known = station_drops_[index_of(station)];
  drops_.kernel += drops.kernel - known.kernel;
  drops_.node += drops.node - known.node;
  known = drops;
}

void Hub::on_last_message(Station& station, const MessageHead& head) {
  Channel* const channel = find(head.channel);
  if (channel == nullptr || channel->subscriptions.empty()) return;
  note_drops(station, head.drops);
  add_loss(*channel,
           losses_.note_last({head.channel, head.sender, head.epoch}, head.number, drops_));
}

void Hub::add_loss(Channel& channel, const Loss& lost) {
  if (lost == Loss{}) return;
  channel.lost += lost;
  counters_.messages_lost_air += lost.air;
  counters_.messages_lost_kernel += lost.kernel;
  counters_.messages_lost_memory += lost.daemon;
  counters_.messages_late += lost.late;
  for (Subscription* subscription : channel.subscriptions) subscription->lost += lost;
}

void Hub::on_message(Station& station, const MessageHead& head,
                     std::span<const std::uint8_t> payload) {
  Channel* const channel = find(head.channel);
  if (channel == nullptr) return;
  const bool is_wanted = !channel->subscriptions.empty();
  if (is_wanted && head.has_wide_number) note_losses(*channel, station, head);
  if (stations_.size() > 1 || head.origin) {
    const std::size_t index = index_of(station);
    if (came_otherwise(index, head, payload)) return;
    cross(index, head, payload);
  }
  if (!is_wanted) return;
  ++counters_.messages_received;
  ++channel->received;
  MessageRef message = pool_.take();
  message->payload.assign(reinterpret_cast<const char*>(payload.data()), payload.size());
  message->channel = head.channel;
  message->sender = head.sender;
  message->epoch = head.epoch;
  message->number = head.number;
  message->distance_m = head.distance_m;
  message->bearing_rad = head.bearing_rad;
  message->sender_pose = head.sender_pose;
  message->hops = head.hops;
  message->ttl = head.ttl;
  message->buffering_delay_us = head.buffering_delay_us;
  message->received_at_ns = head.received_at_ns;
  message->is_time_known = head.is_time_known;
  message->is_local = false;
  message->crossed_gateway = head.crossed_gateway;
  message->origin = head.origin;
  deliver(*channel, message, 0);
}

void Hub::deliver(Channel& channel, const MessageRef& message, std::uint64_t except) {
  for (Subscription* subscription : channel.subscriptions) {
    if (except != 0 && subscription->client->serial() == except) continue;
    const float distance_m = message->distance_m;
    if (subscription->max_distance_m && distance_m > *subscription->max_distance_m) {
      ++counters_.deliveries_too_far;
      continue;
    }
    if (subscription->drops_unknown_distance && distance_m != distance_m) {  // NaN
      ++counters_.deliveries_unknown_distance;
      continue;
    }
    ++counters_.deliveries_queued;
    subscription->client->on_message(*subscription, message);
  }
}

std::optional<Refusal> Hub::set_node_id(std::optional<std::uint16_t> fixed) {
  const auto speaks_as_daemon = [&](Station* s) { return &s->identity() == &identity_; };
  for (Station* station : stations_) {
    if (!fixed || !speaks_as_daemon(station) || *fixed <= station->limits().max_node_id) continue;
    return Refusal{ipc::ERROR_BAD_ARGUMENT,
                   "packets of link '" + station->name() + "' have room for node ids up to " +
                       std::to_string(station->limits().max_node_id),
                   station->limits().max_node_id};
  }
  identity_.set(fixed);
  for (Station* station : stations_) {
    if (speaks_as_daemon(station)) station->adopt_node_id();
  }
  return std::nullopt;
}

// Stations under one id are one node to the swarm's programs: they change together.
void Hub::on_namesake(Station& station) {
  ++counters_.duplicate_node_ids;
  NodeIdentity& identity = station.identity();
  const std::uint16_t old = identity.id();
  if (!identity.is_fixed()) {
    ++counters_.node_id_changes;
    identity.draw_again();
    for (Station* each : stations_) {
      if (&each->identity() == &identity) each->adopt_node_id();
    }
  }
  if (const auto silent = namesake_log_.pass(std::chrono::steady_clock::now())) {
    const std::string what = identity.is_fixed()
                                 ? "ours is configured, so it stays: give one of them another"
                                 : "ours is now " + std::to_string(identity.id());
    log_of("hub")->warn("link {}: another robot has node id {}; {} ({} more since the last line)",
                        station.name(), old, what, *silent);
  }
}

void Hub::on_duplicate(Station& station, const Neighbour& older, const Neighbour& younger) {
  ++counters_.duplicate_neighbours;
  if (const auto silent = duplicate_log_.pass(std::chrono::steady_clock::now())) {
    const drivers::Link& link = station.link();
    log_of("hub")->warn(
        "link {}: two robots have node id {}, one at {}, one at {}; give one of them another "
        "({} more since the last line)",
        station.name(), older.node, link.hardware_text(older.hardware),
        link.hardware_text(younger.hardware), *silent);
  }
}

std::vector<Hub::ChannelView> Hub::channels() const {
  std::vector<ChannelView> views;
  for (const auto& [number, channel] : channels_) {
    if (!channel.has_users() && !channel.is_pinned) continue;
    views.push_back({number,
                     names_.name_of(number),
                     channel.publishers,
                     static_cast<std::uint32_t>(channel.subscriptions.size()),
                     channel.is_timestamped,
                     {},
                     channel.received,
                     channel.lost});
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      if (channel.slots[i].is_open) views.back().links.push_back(stations_[i]->name());
    }
  }
  std::sort(views.begin(), views.end(),
            [](const auto& a, const auto& b) { return a.number < b.number; });
  return views;
}

std::size_t Hub::index_of(const Station& station) const {
  return static_cast<std::size_t>(std::find(stations_.begin(), stations_.end(), &station) -
                                  stations_.begin());
}

Publication& Hub::new_publication() {
  if (free_publications_.empty()) {
    publications_.push_back(std::make_unique<Publication>());
    free_publications_.reserve(publications_.size());
    free_publications_.push_back(publications_.back().get());
  }
  Publication& publication = *free_publications_.back();
  free_publications_.pop_back();
  static_cast<PublicationHead&>(publication) = {};  // the payload keeps its memory
  publication.serial = ++last_publication_;
  return publication;
}

}  // namespace swarmtalk::daemon
