#include "daemon/answer/ping_answerer.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <string>

#include "daemon/station/node_identity.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::string_view kQuestion = "ping";
constexpr std::uint32_t kMostTtl = 255;

/// RUN SEQUENCE ROBOT TTL. None: it is no question.
std::optional<std::array<std::uint32_t, 4>> read_question(std::string_view text) {
  if (!text.starts_with(kQuestion)) return std::nullopt;
  text.remove_prefix(kQuestion.size());
  std::array<std::uint32_t, 4> numbers{};
  for (std::uint32_t& number : numbers) {
    if (!text.starts_with(' ')) return std::nullopt;
    text.remove_prefix(1);
    const auto result = std::from_chars(text.data(), text.data() + text.size(), number);
    if (result.ec != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(result.ptr - text.data()));
  }
  return text.empty() ? std::make_optional(numbers) : std::nullopt;
}

}  // namespace

PingAnswerer::PingAnswerer(Hub& hub, const NodeIdentity& identity, DaemonCounters& counters)
    : identity_(identity), counters_(counters), channel_(hub) {
  channel_.publisher().queue_limit = kMostAnswers;
}

std::optional<Refusal> PingAnswerer::start() {
  return channel_.open(std::string(kQuestion), *this);
}

// The answer waits until the hub has delivered the question to all.
void PingAnswerer::on_message(Subscription&, const MessageRef& message) {
  if (message->is_local) return;
  const auto numbers = read_question(message->payload);
  if (!numbers || (*numbers)[2] != identity_.id()) return;
  const std::pair key(std::uint32_t{message->sender}, (*numbers)[0]);
  if (heard_.size() >= kMostRuns && !heard_.contains(key)) heard_.clear();
  const std::uint32_t count = ++heard_[key];
  if (answers_.size() >= kMostAnswers || !bucket_.take(message->received_at_ns)) {
    ++counters_.pings_unanswered;
    return;
  }
  const std::uint32_t via = message->transmitter != 0 ? message->transmitter : message->sender;
  answers_.push_back({"pong " + std::to_string((*numbers)[0]) + " " +
                          std::to_string((*numbers)[1]) + " " + std::to_string(count) + " " +
                          std::to_string(message->hops) + " " + std::to_string(via),
                      std::min((*numbers)[3], kMostTtl)});
  hook_();
}

void PingAnswerer::answer() {
  for (const Answer& each : std::exchange(answers_, {})) {
    if (channel_.publish(each.text, each.ttl)) {
      ++counters_.pings_unanswered;  // the link is down, or has too many messages already
    } else {
      ++counters_.pings_answered;
    }
  }
}

}  // namespace swarmtalk::daemon
