// What the hub decides before it takes something on: which channel is meant, whether there is room
// for it, and whether a message can be sent at all.
#include <algorithm>
#include <set>

#include "daemon/common/monotonic_ns.hpp"
#include "daemon/hub/hub.hpp"

namespace swarmtalk::daemon {
namespace {

std::string text_of(std::uint64_t number) {
  return std::to_string(number);
}

// A channel as the client called it.
std::string shown(const ChannelRequest& request, std::uint16_t number) {
  if (request.name.empty()) return "channel " + text_of(number);
  return "channel '" + request.name + "' (number " + text_of(number) + ")";
}

}  // namespace

std::optional<Refusal> Hub::resolve(const ChannelRequest& request, std::uint16_t& number) const {
  const auto refuse = [](std::string text) {
    return Refusal{ipc::ERROR_BAD_CHANNEL, std::move(text), std::nullopt};
  };
  std::uint32_t wanted = 0;
  if (!request.name.empty()) {
    auto found = names_.find(request.name);
    if (!found.problem.empty()) return refuse(std::move(found.problem));
    wanted = found.number;
  } else if (request.number) {
    wanted = *request.number;
  } else {
    return refuse("no channel is named; give it a name or a number");
  }
  std::string ranges;
  for (const Station* station : stations_) {
    const StationLimits& own = station->limits();
    if (own.carries(wanted)) {
      number = static_cast<std::uint16_t>(wanted);
      return std::nullopt;
    }
    ranges += (ranges.empty() ? "" : ", ") + ("link " + station->name() + " has 0 to ") +
              text_of(own.max_channel);
  }
  return refuse("channel " + text_of(wanted) + " does not exist on any link (" + ranges + "); " +
                (request.name.empty() ? "take one that does"
                                      : "give '" + request.name + "' a number under [channels]"));
}

// A link whose channel numbers say what is timestamped decides for clients that do not care.
bool Hub::default_timestamping(std::uint16_t number) const {
  return std::any_of(stations_.begin(), stations_.end(), [&](const Station* station) {
    return station->limits().carries(number) && !station->limits().carries(number, false);
  });
}

std::optional<Refusal> Hub::check_carried(const ChannelRequest& request, std::uint16_t number,
                                          bool is_timestamped) const {
  for (const Station* station : stations_) {
    if (station->limits().carries(number, is_timestamped)) return std::nullopt;
  }
  const std::string from = text_of(stations_.front()->limits().timestamped_from);
  return Refusal{ipc::ERROR_CHANNEL_CONFLICT,
                 shown(request, number) + " is never " +
                     (is_timestamped ? "timestamped" : "without timestamps") +
                     " here: the links' packets are timestamped on the channels from " + from +
                     " on, and on no others",
                 std::nullopt};
}

// Finds or makes the channel and holds its name for a new subscription or publisher.
std::optional<Refusal> Hub::use(const ChannelRequest& request, std::string& held_name,
                                Channel*& channel) {
  std::uint16_t number = 0;
  if (auto refusal = resolve(request, number)) return refusal;
  const bool is_timestamped = request.is_timestamped.value_or(default_timestamping(number));
  auto found = channels_.find(number);
  // The first registration decides, until the last publisher and subscriber are gone.
  const bool must_agree =
      found != channels_.end() && (request.is_timestamped || found->second.is_idle());
  if (must_agree && found->second.is_timestamped != is_timestamped) {
    if (!found->second.is_idle()) {
      const std::string registered = is_timestamped ? "without" : "with";
      return Refusal{ipc::ERROR_CHANNEL_CONFLICT,
                     shown(request, number) + " is in use " + registered +
                         " timestamps; use it the same way, or another channel",
                     std::nullopt};
    }
    if (auto refusal = check_carried(request, number, is_timestamped)) return refusal;
    if (auto refusal = open_anew(found->second, is_timestamped)) return refusal;
  }
  if (found == channels_.end()) {
    if (auto refusal = check_carried(request, number, is_timestamped)) return refusal;
    found = channels_.try_emplace(number).first;
    channels_by_number_[number] = &found->second;
    found->second.number = number;
    found->second.slots.resize(stations_.size());
    if (auto refusal = open_anew(found->second, is_timestamped)) {
      erase(found);
      return refusal;
    }
  }
  channel = &found->second;
  channel->last_used = ++use_count_;
  held_name = request.name;
  names_.hold(number, held_name);
  return std::nullopt;
}

// With other timestamping than before, or for the first time. A gateway's links must carry it then,
// or the rule would fall silent.
std::optional<Refusal> Hub::open_anew(Channel& channel, bool is_timestamped) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (!channel.is_pinned || !channel.slots[i].is_open) continue;
    if (stations_[i]->limits().carries(channel.number, is_timestamped)) continue;
    return Refusal{ipc::ERROR_CHANNEL_CONFLICT,
                   "channel " + text_of(channel.number) + " is used by a gateway " +
                       (is_timestamped ? "without" : "with") + " timestamps, as link " +
                       stations_[i]->name() + " has it; use it the same way, or another channel",
                   std::nullopt};
  }
  close(channel);
  channel.is_timestamped = is_timestamped;
  channel.limits = limits_of(channel.number, is_timestamped);
  if (auto refusal = open(channel)) return refusal;
  listen(channel);
  return std::nullopt;
}

// A channel stays open when its last user leaves: that may be in the middle of its `sent`, where a
// node cannot close it. Idle channels go, the longest unused first, when a station has no room.
std::optional<Refusal> Hub::open(Channel& channel) {
  ++channel.publications;  // not idle while it is being opened
  bool is_open = true;
  for (std::size_t i = 0; is_open && i < stations_.size(); ++i) {
    if (!stations_[i]->limits().carries(channel.number, channel.is_timestamped)) continue;
    do {
      is_open = stations_[i]->open_channel(channel.number, channel.is_timestamped);
    } while (!is_open && evict_idle());
    channel.slots[i].is_open = is_open;
  }
  --channel.publications;
  if (is_open) return std::nullopt;
  close(channel);
  return Refusal{ipc::ERROR_LIMIT,
                 "all " + text_of(channels_.size() - 1) +
                     " channels that a link can hold are in use; end programs that no longer need "
                     "theirs",
                 channels_.size() - 1};
}

void Hub::close(Channel& channel) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (std::exchange(channel.slots[i].is_open, false)) stations_[i]->close_channel(channel.number);
  }
}

bool Hub::evict_idle() {
  auto oldest = channels_.end();
  for (auto it = channels_.begin(); it != channels_.end(); ++it) {
    if (!it->second.is_idle() || it->second.is_pinned) continue;
    if (oldest == channels_.end() || it->second.last_used < oldest->second.last_used) oldest = it;
  }
  if (oldest == channels_.end()) return false;
  close(oldest->second);
  erase(oldest);
  return true;
}

Hub::Channel* Hub::find(std::uint16_t number) const {
  Channel* const* const found = channels_by_number_.find(number);
  return found == nullptr ? nullptr : *found;
}

void Hub::erase(std::unordered_map<std::uint16_t, Channel>::iterator channel) {
  channels_by_number_[channel->first] = nullptr;
  channels_.erase(channel);
}

Hub::Limits Hub::limits(std::uint16_t channel_number) const {
  const Channel* const channel = find(channel_number);
  return channel != nullptr ? channel->limits
                            : limits_of(channel_number, default_timestamping(channel_number));
}

Hub::Limits Hub::limits_of(std::uint16_t channel, bool is_timestamped) const {
  Limits least{UINT16_MAX, UINT8_MAX, 0, is_timestamped};
  for (const Station* station : stations_) {
    const StationLimits& own = station->limits();
    if (!own.carries(channel, is_timestamped)) continue;
    least.message_bytes = std::min(least.message_bytes, own.message_bytes(is_timestamped));
    least.ttl = std::min(least.ttl, own.max_ttl);
    least.least_message_bytes = std::max(least.least_message_bytes, own.min_message_bytes);
  }
  return least;
}

bool Hub::carries(std::size_t station, const Channel& channel, std::size_t size_bytes) const {
  const Station& link = *stations_[station];
  return channel.slots[station].is_open && link.is_up() &&
         size_bytes <= link.message_bytes_that_fit(channel.is_timestamped);
}

bool Hub::is_carried(const Channel& channel, std::size_t size_bytes) const {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (carries(i, channel, size_bytes)) return true;
  }
  return false;
}

// Within the profile's limit, but too long for the interfaces as they are.
Refusal Hub::over_mtu(const Channel& channel, std::size_t size_bytes) const {
  std::size_t most = 0;
  std::string states;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    Station* station = stations_[i];
    if (!channel.slots[i].is_open || !station->is_up()) continue;
    most = std::max(most, station->message_bytes_that_fit(channel.is_timestamped));
    states += (states.empty() ? "" : "; ") + station->name() + ": " + station->link().state();
  }
  ++counters_.messages_over_mtu;
  return Refusal{ipc::ERROR_TOO_LONG,
                 "the message has " + text_of(size_bytes) + " bytes, but at most " + text_of(most) +
                     " fit while the MTU of the interface is so small (" + states +
                     "); raise the MTU, or send it in parts",
                 most};
}

std::optional<Refusal> Hub::check_ttl(std::uint32_t ttl, const Limits& most) {
  if (ttl <= most.ttl) return std::nullopt;
  return Refusal{ipc::ERROR_BAD_TTL,
                 "TTL " + text_of(ttl) + " is too large; the limit is " + text_of(most.ttl),
                 most.ttl};
}

void Hub::set_reserved(const ReservedConfig& config) {
  reserved_.clear();
  const auto add = [&](const char* name, bool is_on) {
    const auto found = names_.find(name);
    if (!found.problem.empty()) return;  // a program had the number first
    reserved_.push_back(
        {name, found.number, is_on, config.rate_hz, TokenBucket(config.rate_hz, config.burst)});
  };
  add("debug", config.debug);
  add("harvest", config.harvest);
}

std::optional<Refusal> Hub::check_reserved(std::uint16_t channel) const {
  for (const Reserved& each : reserved_) {
    if (each.number != channel || each.is_on) continue;
    const std::string name = each.name;
    return Refusal{ipc::ERROR_BAD_CHANNEL,
                   "channel '" + name + "' (number " + text_of(channel) +
                       ") is reserved, and off on this robot; set " + name +
                       " = true under [reserved], or take another channel",
                   std::nullopt};
  }
  return std::nullopt;
}

// On a reserved channel all programs of this robot share one pace.
std::optional<Refusal> Hub::take_turn(std::uint16_t channel) {
  for (Reserved& each : reserved_) {
    if (each.number != channel) continue;
    if (auto refusal = check_reserved(channel)) return refusal;  // off since it was advertised
    if (each.turns.take(monotonic_ns())) continue;
    ++counters_.reserved_too_fast;
    return Refusal{ipc::ERROR_RATE,
                   "this robot sends more than " + text_of(each.rate_hz) +
                       " messages per second on channel '" + each.name +
                       "', rate_hz under [reserved]; send fewer",
                   each.rate_hz};
  }
  return std::nullopt;
}

/// Of the links that carry the channel. @return none: one of them is up
std::optional<std::string> Hub::down_states(const Channel& channel) const {
  std::string states;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (!channel.slots[i].is_open) continue;
    if (stations_[i]->is_up()) return std::nullopt;
    states +=
        (states.empty() ? "" : "; ") + stations_[i]->name() + ": " + stations_[i]->link().state();
  }
  return states;
}

std::optional<Refusal> Hub::check_up(const Channel& channel) const {
  const std::optional<std::string> states = down_states(channel);
  if (!states) return std::nullopt;
  ++counters_.messages_link_down;
  return Refusal{ipc::ERROR_LINK_DOWN, "no link is up (" + *states + ")", std::nullopt};
}

std::optional<Refusal> Hub::links_down(std::uint16_t number) const {
  const Channel* channel = find(number);
  const auto states = channel == nullptr ? std::nullopt : down_states(*channel);
  if (!states || states->empty()) return std::nullopt;
  return Refusal{
      ipc::ERROR_LINK_DOWN,
      "no link is up (" + *states + "), so nothing is heard from other robots until one is",
      std::nullopt};
}

void Hub::on_link_state(Station& station) {
  if (station.is_up()) return;
  std::set<HubClient*> told;
  for (const auto& [number, channel] : channels_) {
    if (channel.subscriptions.empty()) continue;
    const auto why = links_down(number);
    if (!why || !channel.slots[index_of(station)].is_open) continue;
    for (const Subscription* subscription : channel.subscriptions) {
      if (told.insert(subscription->client).second) subscription->client->on_links_down(*why);
    }
  }
}

std::optional<Refusal> Hub::check(const Publisher& publisher, const Channel& channel,
                                  std::size_t size_bytes, std::uint32_t ttl) const {
  const Limits& most = channel.limits;
  if (size_bytes > most.message_bytes) {
    return Refusal{ipc::ERROR_TOO_LONG,
                   "the message has " + text_of(size_bytes) + " bytes, the limit is " +
                       text_of(most.message_bytes) + "; send it in parts",
                   most.message_bytes};
  }
  if (size_bytes < most.least_message_bytes) {
    return Refusal{ipc::ERROR_TOO_LONG,
                   "a link of this channel has packets that cannot say how long a message is, so "
                   "one of 0 bytes is impossible; send at least 1 byte",
                   most.message_bytes};
  }
  if (auto refusal = check_ttl(ttl, most)) return refusal;
  if (!is_carried(channel, size_bytes)) {
    if (auto refusal = check_up(channel)) return refusal;
    return over_mtu(channel, size_bytes);
  }
  const bool is_full =
      publisher.in_flight != nullptr && publisher.queue.size() >= publisher.queue_limit;
  if (is_full && (!publisher.drops_oldest || publisher.queue.empty())) {
    ++counters_.messages_busy;
    return Refusal{
        ipc::ERROR_BUSY,
        publisher.queue_limit == 0
            ? "this publisher's previous message has not left yet; wait for it to be sent"
            : "this publisher's queue of " + text_of(publisher.queue_limit) +
                  " messages is full; wait for one to be sent",
        std::nullopt};
  }
  if (waiting_ >= limits_.waiting_messages && !is_full) {
    return Refusal{ipc::ERROR_LIMIT,
                   text_of(waiting_) +
                       " messages of all clients wait for a link already; "
                       "publish more slowly",
                   limits_.waiting_messages};
  }
  return std::nullopt;
}

}  // namespace swarmtalk::daemon
