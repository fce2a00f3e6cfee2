#include "daemon/hub/hub.hpp"

#include <algorithm>
#include <chrono>
#include <set>

#include "daemon/common/logging.hpp"
#include "daemon/common/monotonic_ns.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::daemon {
namespace {

std::span<const std::uint8_t> bytes_of(std::string_view payload) {
  return {reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()};
}

}  // namespace

Hub::Hub(ChannelTable& names, const LimitsConfig& limits, DaemonCounters& counters,
         NodeIdentity& identity)
    : counters_(counters),
      identity_(identity),
      channels_(names, stations_),
      shares_(limits),
      admission_(stations_, channels_, names, shares_, counters),
      outbox_(stations_, channels_, counters, *this),
      gateways_(stations_, channels_, outbox_, identity, counters),
      delivery_(limits.tracked_senders, counters) {}

// Whether the client may have one more subscription or publisher there.
std::optional<Refusal> Hub::check_share(const ChannelRequest& request, const HubClient& client,
                                        Shares::End end) {
  std::uint16_t number = 0;
  if (auto refusal = channels_.resolve(request, number)) return tell_users(refusal, request);
  auto refusal = shares_.check_end(client.share, end, number);
  if (refusal) ++counters_.shares_refused;
  return refusal;
}

// A name that another's number blocks, and links that are full: whoever is refused is told by whom.
std::optional<Refusal> Hub::tell_users(std::optional<Refusal> refusal,
                                       const ChannelRequest& request) const {
  if (!refusal) return refusal;
  if (refusal->code == ipc::ERROR_LIMIT) refusal->text += shares_.most_channels();
  if (refusal->code != ipc::ERROR_BAD_CHANNEL || request.name.empty()) return refusal;
  const std::string users = shares_.users_of(ChannelTable::hash(request.name));
  if (!users.empty()) refusal->text += " (the other is in use by programs of " + users + ")";
  return refusal;
}

std::optional<Refusal> Hub::subscribe(const ChannelRequest& request, Subscription& subscription) {
  constexpr Shares::End kEnd = Shares::End::kSubscription;
  if (subscription.client != nullptr) {  // nobody's is not counted
    if (auto refusal = check_share(request, *subscription.client, kEnd)) return refusal;
  }
  Channel* channel = nullptr;
  if (auto refusal = channels_.use(request, subscription.held_name, channel)) {
    return tell_users(refusal, request);
  }
  subscription.channel = channel->number;
  if (subscription.client != nullptr) {
    Shares::hold(subscription.client->share, kEnd, channel->number);
  }
  channel->subscriptions.push_back(&subscription);
  if (channel->subscriptions.size() == 1) channels_.listen(*channel);
  return std::nullopt;
}

void Hub::unsubscribe(Subscription& subscription) {
  Channel& channel = *channels_.find(subscription.channel);
  std::erase(channel.subscriptions, &subscription);
  if (subscription.client != nullptr) {
    Shares::release(subscription.client->share, Shares::End::kSubscription, channel.number);
  }
  channels_.release(channel, subscription.held_name);
  if (!channel.subscriptions.empty()) return;
  delivery_.forget(channel.number);
  channels_.listen(channel);
}

std::optional<Refusal> Hub::advertise(const ChannelRequest& request, Publisher& publisher) {
  constexpr Shares::End kEnd = Shares::End::kPublisher;
  if (publisher.client != nullptr) {  // nobody's is not counted
    if (auto refusal = check_share(request, *publisher.client, kEnd)) return refusal;
  }
  std::uint16_t number = 0;
  if (auto refusal = channels_.resolve(request, number)) return refusal;
  if (!publisher.is_daemons_own) {
    if (auto refusal = admission_.check_reserved(number)) return refusal;
  }
  if (auto refusal = Admission::check_ttl(request.ttl, limits(number))) return refusal;
  publisher.ttl = static_cast<std::uint8_t>(request.ttl);
  Channel* channel = nullptr;
  if (auto refusal = channels_.use(request, publisher.held_name, channel)) {
    return tell_users(refusal, request);
  }
  publisher.channel = channel->number;
  if (publisher.client != nullptr) {
    Shares::hold(publisher.client->share, kEnd, channel->number);
  }
  ++channel->publishers;
  return std::nullopt;
}

void Hub::unadvertise(Publisher& publisher) {
  Channel& channel = *channels_.find(publisher.channel);
  --channel.publishers;
  if (publisher.client != nullptr) {
    Shares::release(publisher.client->share, Shares::End::kPublisher, channel.number);
  }
  channels_.release(channel, publisher.held_name);
  outbox_.withdraw(publisher);
}

std::optional<Refusal> Hub::publish(Publisher& publisher, std::uint64_t number,
                                    std::string_view payload, std::optional<std::uint32_t> ttl,
                                    std::optional<std::uint64_t> sent_at_ns) {
  Channel& channel = *channels_.find(publisher.channel);
  const std::uint32_t hops = ttl.value_or(publisher.ttl);
  auto refusal =
      admission_.admit(publisher, channel, payload.size(), hops, outbox_.waiting_for_room());
  if (refusal) {
    if (refusal->code == ipc::ERROR_LINK_DOWN) {
      outbox_.give_up_on_dead_links();  // what came before it is heard before it
      PublicationHead unsent;
      unsent.client = publisher.client->serial();
      unsent.ttl = static_cast<std::uint8_t>(hops);
      unsent.sent_at_ns = sent_at_ns.value_or(monotonic_ns());
      deliver_here(unsent, channel, bytes_of(payload));
    }
    return refusal;
  }
  outbox_.publish(publisher, channel, number, payload, static_cast<std::uint8_t>(hops), sent_at_ns);
  return std::nullopt;
}

void Hub::on_message(Station& station, const MessageHead& head,
                     std::span<const std::uint8_t> payload) {
  Channel* const channel = channels_.find(head.channel);
  if (channel == nullptr) return;
  const bool is_wanted = !channel->subscriptions.empty();
  const std::size_t index = stations_.index_of(station);
  if (is_wanted && head.has_wide_number) delivery_.note_losses(*channel, index, head);
  if (stations_.size() > 1 || head.origin) {
    if (gateways_.came_otherwise(index, head, payload)) return;
    gateways_.cross(index, head, payload);
  }
  if (is_wanted) delivery_.deliver(*channel, head, payload);
}

// Programs of this robot hear a message when it begins to leave, as if from a robot beside them.
void Hub::on_outgoing(const Publication& publication, std::size_t station, Channel& channel,
                      std::uint32_t number) {
  if (publication.rule == nullptr) gateways_.cross_own(publication, channel, number);
  const auto is_other = [&](const Subscription* s) {
    return s->client->serial() != publication.client;
  };
  if (std::none_of(channel.subscriptions.begin(), channel.subscriptions.end(), is_other)) return;
  MessageHead head = own_head(channel);
  head.sender = stations_[station].identity().id();
  head.number = number;
  head.ttl = publication.ttl;
  if (channel.is_timestamped) head.buffering_delay_us = publication.told_us(head.received_at_ns);
  head.crossed_gateway = publication.rule != nullptr;
  head.origin = publication.origin;
  delivery_.deliver_own(channel, head, publication.bytes(), publication.client);
}

void Hub::on_stayed_here(const Publication& publication, Channel& channel) {
  deliver_here(publication, channel, publication.bytes());
}

// Whether a robot's programs hear each other does not depend on its links.
void Hub::deliver_here(const PublicationHead& publication, Channel& channel,
                       std::span<const std::uint8_t> payload) {
  MessageHead head = own_head(channel);
  head.ttl = publication.ttl;
  if (channel.is_timestamped) head.buffering_delay_us = publication.told_us(head.received_at_ns);
  delivery_.deliver_own(channel, head, payload, publication.client);
}

MessageHead Hub::own_head(const Channel& channel) const {
  MessageHead head;
  head.channel = channel.number;
  head.sender = identity_.id();
  head.epoch = identity_.epoch() & 0xFFFFu;  // as a packet carries it
  head.distance_m = 0.0f;
  head.received_at_ns = monotonic_ns();
  return head;
}

void Hub::tell_programs(const Publisher& publisher, std::string_view payload) {
  Channel& channel = *channels_.find(publisher.channel);
  delivery_.deliver_own(channel, own_head(channel), bytes_of(payload), publisher.client->serial());
}

void Hub::on_last_message(Station& station, const MessageHead& head) {
  Channel* const channel = channels_.find(head.channel);
  if (channel == nullptr || channel->subscriptions.empty()) return;
  delivery_.note_last(*channel, stations_.index_of(station), head);
}

void Hub::on_link_state(Station& station) {
  if (station.is_up()) return;
  std::set<HubClient*> told;
  for (const auto& [number, channel] : channels_.all()) {
    if (channel.subscriptions.empty()) continue;
    const auto why = links_down(number);
    if (!why || !channel.slots[stations_.index_of(station)].is_open) continue;
    for (const Subscription* subscription : channel.subscriptions) {
      if (told.insert(subscription->client).second) subscription->client->on_links_down(*why);
    }
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
  if (const auto silent = namesake_log_.pass(loop::now())) {
    const std::string what = identity.is_fixed()
                                 ? "ours is configured, so it stays: give one of them another"
                                 : "ours is now " + std::to_string(identity.id());
    log_of("hub")->warn("link {}: another robot has node id {}; {} ({} more since the last line)",
                        station.name(), old, what, *silent);
  }
}

void Hub::on_duplicate(Station& station, const Neighbour& older, const Neighbour& younger) {
  ++counters_.duplicate_neighbours;
  if (const auto silent = duplicate_log_.pass(loop::now())) {
    const drivers::Link& link = station.link();
    log_of("hub")->warn(
        "link {}: two robots have node id {}, one at {}, one at {}; give one of them another "
        "({} more since the last line)",
        station.name(), older.node, link.hardware_text(older.hardware),
        link.hardware_text(younger.hardware), *silent);
  }
}

void Hub::on_double_address(Station& station, const Neighbour& other) {
  if (const auto silent = address_log_.pass(loop::now())) {
    log_of("hub")->warn(
        "link {}: another robot has this interface's hardware address {}: node {}; give one of "
        "them another ({} more since the last line)",
        station.name(), station.link().hardware_text(other.hardware), other.node, *silent);
  }
}

}  // namespace swarmtalk::daemon
