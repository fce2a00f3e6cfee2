#include "daemon/hub/gateways.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "loop/clock.hpp"

namespace swarmtalk::daemon {

std::optional<Refusal> Gateways::set_rules(std::vector<GatewayRule> rules) {
  rules_ = std::move(rules);
  for (const GatewayRule& rule : rules_) {
    if (auto refusal = channels_.pin(rule.from_channel, rule.from_link)) return refusal;
    if (auto refusal = channels_.pin(rule.to_channel, stations_.size())) return refusal;
  }
  return std::nullopt;
}

bool Gateways::came_otherwise(std::size_t station, const MessageHead& head,
                              std::span<const std::uint8_t> payload) {
  SeenMessages::Identity identity{head.sender, static_cast<std::uint16_t>(head.epoch), head.number,
                                  head.channel, payload};
  if (head.origin) {
    identity.node = head.origin->node;
    identity.epoch = head.origin->epoch;
    identity.number = head.origin->number;
  }
  const bool is_known = seen_.came_otherwise(identity, {station, head.sender}, loop::now());
  if (is_known) ++counters_.link_duplicates;
  return is_known;
}

void Gateways::cross(std::size_t station, const MessageHead& head,
                     std::span<const std::uint8_t> payload) {
  for (const GatewayRule& rule : rules_) {
    if (rule.from_link != station || rule.from_channel != head.channel) continue;
    if (head.crossed_gateway) {
      ++counters_.gateway_crossed;
      continue;
    }
    copy(rule,
         {stations_[station].name(), head.sender, static_cast<std::uint16_t>(head.epoch),
          head.number},
         payload, head.ttl);
  }
}

// Our own programs' messages go where the same from another robot would, unless they left there on
// that very channel.
void Gateways::cross_own(const Publication& publication, const Channel& channel,
                         std::uint32_t number) {
  for (auto rule = rules_.begin(); rule != rules_.end(); ++rule) {
    if (rule->from_channel != channel.number || rule->to_channel == channel.number) continue;
    const auto is_same_target = [&](const GatewayRule& other) {
      return other.from_channel == channel.number && other.to_link == rule->to_link &&
             other.to_channel == rule->to_channel;
    };
    if (std::any_of(rules_.begin(), rule, is_same_target)) continue;
    Station& from = stations_[rule->from_link];
    copy(*rule,
         {from.name(), from.identity().id(), static_cast<std::uint16_t>(identity_.epoch()), number},
         publication.bytes(), publication.ttl);
  }
}

void Gateways::copy(const GatewayRule& rule, GatewayOrigin origin,
                    std::span<const std::uint8_t> payload, std::uint8_t ttl) {
  Station& station = stations_[rule.to_link];
  Channel& channel = *channels_.find(rule.to_channel);
  const StationLimits& limits = station.limits();
  const std::size_t around = limits.marks_gateways ? origin_bytes(origin) : 0;
  const bool is_there =
      seen_.came_otherwise({origin.node, origin.epoch, origin.number, rule.to_channel, payload},
                           {rule.to_link, station.identity().id()}, loop::now());
  if (rule.from_channel != rule.to_channel && is_there) {
    ++counters_.gateway_there;
  } else if (payload.size() < limits.min_message_bytes) {
    ++counters_.gateway_empty;
  } else if (!station.is_up()) {
    ++counters_.gateway_link_down;
  } else if (!channels_.carries(rule.to_link, channel, payload.size() + around)) {
    ++counters_.gateway_too_long;
  } else {
    outbox_.copy(rule, channel, payload, std::move(origin),
                 std::min(rule.ttl.value_or(ttl), limits.max_ttl));
  }
}

}  // namespace swarmtalk::daemon
