#include "daemon/hub/channel_registry.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::daemon {
namespace {

// A channel as the client called it.
std::string shown(const ChannelRequest& request, std::uint16_t number) {
  if (request.name.empty()) return "channel " + std::to_string(number);
  return "channel '" + request.name + "' (number " + std::to_string(number) + ")";
}

}  // namespace

std::optional<Refusal> ChannelRegistry::resolve(const ChannelRequest& request,
                                                std::uint16_t& number) const {
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
              std::to_string(own.max_channel);
  }
  return refuse("channel " + std::to_string(wanted) + " does not exist on any link (" + ranges +
                "); " +
                (request.name.empty() ? "take one that does"
                                      : "give '" + request.name + "' a number under [channels]"));
}

// A link whose channel numbers say what is timestamped decides for clients that do not care.
bool ChannelRegistry::default_timestamping(std::uint16_t number) const {
  return std::any_of(stations_.begin(), stations_.end(), [&](const Station* station) {
    return station->limits().carries(number) && !station->limits().carries(number, false);
  });
}

std::optional<Refusal> ChannelRegistry::check_carried(const ChannelRequest& request,
                                                      std::uint16_t number,
                                                      bool is_timestamped) const {
  for (const Station* station : stations_) {
    if (station->limits().carries(number, is_timestamped)) return std::nullopt;
  }
  const std::string from = std::to_string(stations_[0].limits().timestamped_from);
  return Refusal{ipc::ERROR_CHANNEL_CONFLICT,
                 shown(request, number) + " is never " +
                     (is_timestamped ? "timestamped" : "without timestamps") +
                     " here: the links' packets are timestamped on the channels from " + from +
                     " on, and on no others",
                 std::nullopt};
}

std::optional<Refusal> ChannelRegistry::use(const ChannelRequest& request, std::string& held_name,
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
  touch(*channel);
  held_name = request.name;
  names_.hold(number, held_name);
  return std::nullopt;
}

std::optional<Refusal> ChannelRegistry::pin(std::uint16_t number, std::size_t listening_station) {
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

// With other timestamping than before, or for the first time. A gateway's links must carry it then,
// or the rule would fall silent.
std::optional<Refusal> ChannelRegistry::open_anew(Channel& channel, bool is_timestamped) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (!channel.is_pinned || !channel.slots[i].is_open) continue;
    if (stations_[i].limits().carries(channel.number, is_timestamped)) continue;
    return Refusal{ipc::ERROR_CHANNEL_CONFLICT,
                   "channel " + std::to_string(channel.number) + " is used by a gateway " +
                       (is_timestamped ? "without" : "with") + " timestamps, as link " +
                       stations_[i].name() + " has it; use it the same way, or another channel",
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
std::optional<Refusal> ChannelRegistry::open(Channel& channel) {
  ++channel.publications;  // not idle while it is being opened
  bool is_open = true;
  for (std::size_t i = 0; is_open && i < stations_.size(); ++i) {
    if (!stations_[i].limits().carries(channel.number, channel.is_timestamped)) continue;
    do {
      is_open = stations_[i].open_channel(channel.number, channel.is_timestamped);
    } while (!is_open && evict_idle());
    channel.slots[i].is_open = is_open;
  }
  --channel.publications;
  if (is_open) return std::nullopt;
  close(channel);
  return Refusal{ipc::ERROR_LIMIT,
                 "all " + std::to_string(channels_.size() - 1) +
                     " channels that a link can hold are in use; end programs that no longer need "
                     "theirs",
                 channels_.size() - 1};
}

void ChannelRegistry::close(Channel& channel) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (std::exchange(channel.slots[i].is_open, false)) stations_[i].close_channel(channel.number);
  }
}

bool ChannelRegistry::evict_idle() {
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

Channel* ChannelRegistry::find(std::uint16_t number) const {
  Channel* const* const found = channels_by_number_.find(number);
  return found == nullptr ? nullptr : *found;
}

void ChannelRegistry::erase(Channels::iterator channel) {
  channels_by_number_[channel->first] = nullptr;
  channels_.erase(channel);
}

void ChannelRegistry::listen(const Channel& channel) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    const Slot& slot = channel.slots[i];
    if (!slot.is_open) continue;
    const bool is_heard = slot.is_gateway || !channel.subscriptions.empty();
    // A node that ceases to listen forgets what it has sent. Outbox calls again after the last
    // copy.
    if (!is_heard && slot.is_between_copies) continue;
    stations_[i].set_listening(channel.number, is_heard);
  }
}

ChannelLimits ChannelRegistry::limits(std::uint16_t channel_number) const {
  const Channel* const channel = find(channel_number);
  return channel != nullptr ? channel->limits
                            : limits_of(channel_number, default_timestamping(channel_number));
}

ChannelLimits ChannelRegistry::limits_of(std::uint16_t channel, bool is_timestamped) const {
  ChannelLimits least{UINT16_MAX, UINT8_MAX, 0, is_timestamped};
  for (const Station* station : stations_) {
    const StationLimits& own = station->limits();
    if (!own.carries(channel, is_timestamped)) continue;
    least.message_bytes = std::min(least.message_bytes, own.message_bytes(is_timestamped));
    least.ttl = std::min(least.ttl, own.max_ttl);
    least.least_message_bytes = std::max(least.least_message_bytes, own.min_message_bytes);
    least.has_redundancy = least.has_redundancy || station->has_redundancy();
  }
  return least;
}

bool ChannelRegistry::carries(std::size_t station, const Channel& channel,
                              std::size_t size_bytes) const {
  const Station& link = stations_[station];
  return channel.slots[station].is_open && link.is_up() &&
         size_bytes <= link.message_bytes_that_fit(channel.is_timestamped);
}

bool ChannelRegistry::is_carried(const Channel& channel, std::size_t size_bytes) const {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (carries(i, channel, size_bytes)) return true;
  }
  return false;
}

std::optional<std::string> ChannelRegistry::down_states(const Channel& channel) const {
  std::string states;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (!channel.slots[i].is_open) continue;
    if (stations_[i].is_up()) return std::nullopt;
    states +=
        (states.empty() ? "" : "; ") + stations_[i].name() + ": " + stations_[i].link().state();
  }
  return states;
}

std::optional<Refusal> ChannelRegistry::links_down(std::uint16_t number) const {
  const Channel* channel = find(number);
  const auto states = channel == nullptr ? std::nullopt : down_states(*channel);
  if (!states || states->empty()) return std::nullopt;
  return Refusal{
      ipc::ERROR_LINK_DOWN,
      "no link is up (" + *states + "), so nothing is heard from other robots until one is",
      std::nullopt};
}

std::vector<ChannelView> ChannelRegistry::views() const {
  std::vector<ChannelView> views;
  for (const auto& [number, channel] : channels_) {
    if (!channel.has_users() && !channel.is_pinned) continue;
    views.push_back({number,
                     names_.name_of(number),
                     channel.publishers,
                     static_cast<std::uint32_t>(channel.subscriptions.size()),
                     static_cast<std::uint32_t>(
                         std::count_if(channel.subscriptions.begin(), channel.subscriptions.end(),
                                       [](const Subscription* each) { return each->looks_on; })),
                     channel.is_timestamped,
                     {},
                     channel.received,
                     channel.lost,
                     channel.refused});
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      if (channel.slots[i].is_open) views.back().links.push_back(stations_[i].name());
    }
  }
  std::sort(views.begin(), views.end(),
            [](const auto& a, const auto& b) { return a.number < b.number; });
  return views;
}

}  // namespace swarmtalk::daemon
