#include "daemon/hub/admission.hpp"

#include <algorithm>

#include "daemon/common/monotonic_ns.hpp"

namespace swarmtalk::daemon {

std::optional<Refusal> Admission::admit(const Publisher& publisher, const Channel& channel,
                                        std::size_t size_bytes, std::uint32_t ttl,
                                        const Waiting& waiting) {
  if (auto refusal = check(publisher, channel, size_bytes, ttl, waiting)) return refusal;
  return publisher.is_daemons_own ? std::nullopt : take_turn(channel.number);
}

void Admission::set_reserved(const ReservedConfig& config, const std::string& how_to_change) {
  how_to_change_ = how_to_change;
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

std::optional<Refusal> Admission::check_reserved(std::uint16_t channel) const {
  for (const Reserved& each : reserved_) {
    if (each.number != channel || each.is_on) continue;
    const std::string name = each.name;
    return Refusal{
        ipc::ERROR_BAD_CHANNEL,
        "channel '" + name + "' (number " + std::to_string(channel) +
            ") is reserved, and off on this robot; before the program's next start set " + name +
            " = true under [reserved] in " + how_to_change_,
        std::nullopt};
  }
  return std::nullopt;
}

std::optional<Refusal> Admission::check_ttl(std::uint32_t ttl, const ChannelLimits& most) {
  if (ttl <= most.ttl) return std::nullopt;
  return Refusal{
      ipc::ERROR_BAD_TTL,
      "TTL " + std::to_string(ttl) + " is too large; the limit is " + std::to_string(most.ttl),
      most.ttl};
}

// On a reserved channel all programs of this robot share one pace.
std::optional<Refusal> Admission::take_turn(std::uint16_t channel) {
  for (Reserved& each : reserved_) {
    if (each.number != channel) continue;
    if (auto refusal = check_reserved(channel)) return refusal;  // off since it was advertised
    if (each.turns.take(monotonic_ns())) continue;
    ++counters_.reserved_too_fast;
    return Refusal{ipc::ERROR_RATE,
                   "this robot sends more than " + std::to_string(each.rate_hz) +
                       " messages per second on channel '" + each.name +
                       "', rate_hz under [reserved]; send fewer",
                   each.rate_hz};
  }
  return std::nullopt;
}

std::optional<Refusal> Admission::check(const Publisher& publisher, const Channel& channel,
                                        std::size_t size_bytes, std::uint32_t ttl,
                                        const Waiting& waiting) const {
  const ChannelLimits& most = channel.limits;
  if (size_bytes > most.message_bytes) {
    return Refusal{ipc::ERROR_TOO_LONG,
                   "the message has " + std::to_string(size_bytes) + " bytes, the limit is " +
                       std::to_string(most.message_bytes) + "; send it in parts",
                   most.message_bytes};
  }
  if (size_bytes < most.least_message_bytes) {
    return Refusal{ipc::ERROR_TOO_LONG,
                   "a link of this channel has packets that cannot say how long a message is, so "
                   "one of 0 bytes is impossible; send at least 1 byte",
                   most.message_bytes};
  }
  if (auto refusal = check_ttl(ttl, most)) return refusal;
  if (!channels_.is_carried(channel, size_bytes)) {
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
            : "this publisher's queue of " + std::to_string(publisher.queue_limit) +
                  " messages is full; wait for one to be sent",
        std::nullopt};
  }
  if (is_full) return std::nullopt;  // it takes the place of another
  auto refusal = shares_.check_message(publisher.client->share, size_bytes, waiting);
  if (refusal) ++counters_.messages_over_share;
  return refusal;
}

std::optional<Refusal> Admission::check_up(const Channel& channel) const {
  const std::optional<std::string> states = channels_.down_states(channel);
  if (!states) return std::nullopt;
  ++counters_.messages_link_down;
  return Refusal{ipc::ERROR_LINK_DOWN,
                 "no link is up (" + *states + "), so only programs of this robot hear it",
                 std::nullopt};
}

// Within the profile's limit, but too long for the interfaces as they are.
Refusal Admission::over_mtu(const Channel& channel, std::size_t size_bytes) const {
  std::size_t most = 0;
  std::string states;
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    Station& station = stations_[i];
    if (!channel.slots[i].is_open || !station.is_up()) continue;
    most = std::max(most, station.message_bytes_that_fit(channel.is_timestamped));
    states += (states.empty() ? "" : "; ") + station.name() + ": " + station.link().state();
  }
  ++counters_.messages_over_mtu;
  return Refusal{ipc::ERROR_TOO_LONG,
                 "the message has " + std::to_string(size_bytes) + " bytes, but at most " +
                     std::to_string(most) + " fit while the MTU of the interface is so small (" +
                     states + "); raise the MTU, or send it in parts",
                 most};
}

}  // namespace swarmtalk::daemon
