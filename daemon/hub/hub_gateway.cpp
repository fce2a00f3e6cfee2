// The hub's gateway rules: which messages are copied to another link, and which are not, so that
// none goes round in circles. A copy is marked as having crossed and never crosses again; where
// packets have no bit for that, gateways send under node ids of their own.
#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/common/monotonic_ns.hpp"
#include "daemon/hub/hub.hpp"

namespace swarmtalk::daemon {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& payload) {
  return {reinterpret_cast<const std::uint8_t*>(payload.data()), payload.size()};
}

}  // namespace

std::optional<Refusal> Hub::set_gateways(std::vector<GatewayRule> rules) {
  rules_ = std::move(rules);
  for (const GatewayRule& rule : rules_) {
    if (auto refusal = pin(rule.from_channel, rule.from_link)) return refusal;
    if (auto refusal = pin(rule.to_channel, stations_.size())) return refusal;
  }
  return std::nullopt;
}

// Opens a channel for good. @param listening_station  where it is heard; none beyond the last
std::optional<Refusal> Hub::pin(std::uint16_t number, std::size_t listening_station) {
  Channel* channel = nullptr;
  std::string no_name;
  ChannelRequest request;
  request.number = number;
  if (auto refusal = use(request, no_name, channel)) return refusal;
  channel->is_pinned = true;
  if (listening_station < stations_.size()) channel->slots[listening_station].is_gateway = true;
  listen(*channel);
  return std::nullopt;
}

bool Hub::came_otherwise(std::size_t station, const MessageHead& head,
                         std::span<const std::uint8_t> payload) {
  SeenMessages::Identity identity{head.sender, static_cast<std::uint16_t>(head.epoch), head.number,
                                  head.channel, payload};
  if (head.origin) {
    identity.node = head.origin->node;
    identity.epoch = head.origin->epoch;
    identity.number = head.origin->number;
  }
  const bool is_known =
      seen_.came_otherwise(identity, {station, head.sender}, std::chrono::steady_clock::now());
  if (is_known) ++counters_.link_duplicates;
  return is_known;
}

void Hub::cross(std::size_t station, const MessageHead& head,
                std::span<const std::uint8_t> payload) {
  for (const GatewayRule& rule : rules_) {
    if (rule.from_link != station || rule.from_channel != head.channel) continue;
    if (head.crossed_gateway) {
      ++counters_.gateway_crossed;
      continue;
    }
    copy(rule,
         {stations_[station]->name(), head.sender, static_cast<std::uint16_t>(head.epoch),
          head.number},
         payload, head.ttl);
  }
}

// Our own programs' messages go where the same from another robot would, unless they left there on
// that very channel.
void Hub::cross_own(const Publication& publication, const Channel& channel, std::uint32_t number) {
  for (auto rule = rules_.begin(); rule != rules_.end(); ++rule) {
    if (rule->from_channel != channel.number || rule->to_channel == channel.number) continue;
    const auto is_same_target = [&](const GatewayRule& other) {
      return other.from_channel == channel.number && other.to_link == rule->to_link &&
             other.to_channel == rule->to_channel;
    };
    if (std::any_of(rules_.begin(), rule, is_same_target)) continue;
    const Station& from = *stations_[rule->from_link];
    copy(*rule,
         {from.name(), stations_[rule->from_link]->identity().id(),
          static_cast<std::uint16_t>(identity_.epoch()), number},
         bytes_of(publication.payload), publication.ttl);
  }
}

void Hub::copy(const GatewayRule& rule, GatewayOrigin origin, std::span<const std::uint8_t> payload,
               std::uint8_t ttl) {
  Station& station = *stations_[rule.to_link];
  Channel& channel = *find(rule.to_channel);
  const StationLimits& limits = station.limits();
  const std::size_t around = limits.marks_gateways ? origin_bytes(origin) : 0;
  const bool is_there = seen_.came_otherwise(
      {origin.node, origin.epoch, origin.number, rule.to_channel, payload},
      {rule.to_link, station.identity().id()}, std::chrono::steady_clock::now());
  if (rule.from_channel != rule.to_channel && is_there) {
    ++counters_.gateway_there;
  } else if (payload.size() < limits.min_message_bytes) {
    ++counters_.gateway_empty;
  } else if (!station.is_up()) {
    ++counters_.gateway_link_down;
  } else if (!carries(rule.to_link, channel, payload.size() + around)) {
    ++counters_.gateway_too_long;
  } else {
    make_room(rule, channel);
    Publication& publication = new_publication();
    publication.payload.assign(payload.begin(), payload.end());
    publication.ttl = std::min(rule.ttl.value_or(ttl), limits.max_ttl);
    publication.rule = &rule;
    publication.sent_at_ns = monotonic_ns();
    publication.origin = std::move(origin);
    publication.pending = 1;
    publication.is_heard_locally = rule.from_channel == rule.to_channel;  // as the original
    ++channel.publications;
    channel.last_used = ++use_count_;
    if (waiting_++ == 0) waiting_hook_();
    channel.slots[rule.to_link].waiting.push_back(&publication);
    feed(rule.to_link, channel);
  }
}

// Of the copies that wait for a slow link the newest are worth most.
void Hub::make_room(const GatewayRule& rule, Channel& channel) {
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

void Hub::count_copy(const Publication& publication) {
  if (publication.sent > 0) {
    ++counters_.gateway_sent;
  } else if (publication.is_replaced) {
    ++counters_.gateway_full;
  } else {
    ++counters_.gateway_link_down;
  }
}

}  // namespace swarmtalk::daemon
