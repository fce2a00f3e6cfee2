#include "daemon/session/client_channels.hpp"

#include <algorithm>
#include <utility>

#include "daemon/common/monotonic_ns.hpp"
#include "daemon/message/redundancy.hpp"
#include "text/plain.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::uint32_t kLongestCopyIntervalMs = 10'000;

ChannelRequest channel_request(const ipc::Channel& channel) {
  ChannelRequest request;
  request.name = channel.name();
  if (channel.has_number()) request.number = channel.number();
  return request;
}

Refusal unknown_id(const char* what, std::uint32_t id) {
  return {ipc::ERROR_UNKNOWN_ID,
          "this connection has no " + std::string(what) + " " + std::to_string(id), std::nullopt};
}

/// @param key  of [limits], which has the limit
Refusal over_limit(const std::string& what, std::uint64_t limit, const std::string& key) {
  return {ipc::ERROR_LIMIT,
          what + " are limited to " + std::to_string(limit) + " (" + key +
              " under [limits]); close one first",
          limit};
}

Refusal not_within(const std::string& what, std::uint64_t limit, const std::string& key,
                   std::uint64_t wanted) {
  return {ipc::ERROR_LIMIT,
          what + " must be 1 to " + std::to_string(limit) + " (" + key + " under [limits]), not " +
              std::to_string(wanted),
          limit};
}

Refusal too_fast(std::uint32_t rate_hz) {
  return {ipc::ERROR_RATE,
          "this client publishes more than " + std::to_string(rate_hz) +
              (rate_hz == 1 ? " message" : " messages") +
              " per second, publish_rate_hz under [limits]; publish more slowly",
          rate_hz};
}

}  // namespace

ClientChannels::ClientChannels(Hub& hub, const LimitsConfig& limits, DaemonCounters& counters,
                               ClientOutput& output, ClientAnswers& answers)
    : hub_(hub),
      limits_(limits),
      counters_(counters),
      output_(output),
      answers_(answers),
      publish_bucket_(limits.publish_rate_hz, limits.publish_burst) {}

void ClientChannels::leave() {
  for (auto& [id, subscription] : subscriptions_) {
    hub_.unsubscribe(*subscription);
    output_.forget(*subscription);
  }
  for (auto& [id, publisher] : publishers_) hub_.unadvertise(*publisher);
  subscriptions_.clear();
  publishers_.clear();
}

void ClientChannels::subscribe(const ipc::Subscribe& request) {
  if (subscriptions_.size() >= limits_.subscriptions_per_client) {
    return answers_.refuse(over_limit("a client's subscriptions", limits_.subscriptions_per_client,
                                      "subscriptions_per_client"));
  }
  const std::uint32_t keep_last =
      request.has_keep_last() ? request.keep_last() : limits_.queue_messages;
  if (keep_last == 0 || keep_last > limits_.queue_messages_max) {
    return answers_.refuse(
        not_within("keep_last", limits_.queue_messages_max, "queue_messages_max", keep_last));
  }
  if (request.has_max_distance_m() && !(request.max_distance_m() >= 0.0f)) {  // or NaN
    return answers_.refuse(
        {ipc::ERROR_BAD_DISTANCE,
         "max_distance_m must be 0 or more metres; leave it out for any distance", std::nullopt});
  }
  if (request.has_max_age_ms() && request.max_age_ms() == 0) {  // would drop everything
    return answers_.refuse(
        {ipc::ERROR_BAD_ARGUMENT,
         "a message's greatest age begins at 1 millisecond; leave it out for any age",
         std::nullopt});
  }
  auto subscription = std::make_unique<QueuedSubscription>(keep_last, request.latest_of_each());
  if (request.has_max_age_ms()) subscription->max_age_ms = request.max_age_ms();
  subscription->client = this;
  subscription->id = ++last_id_;
  if (request.has_max_distance_m()) subscription->max_distance_m = request.max_distance_m();
  subscription->drops_unknown_distance = request.drop_unknown_distance();
  subscription->looks_on = request.looks_on();
  ChannelRequest channel = channel_request(request.channel());
  if (request.has_timestamped()) channel.is_timestamped = request.timestamped();
  if (const auto refusal = hub_.subscribe(channel, *subscription)) return answers_.refuse(*refusal);
  ipc::Subscribed& reply = *answers_.make().mutable_subscribed();
  reply.set_subscription_id(subscription->id);
  reply.set_channel(subscription->channel);
  const auto why = hub_.links_down(subscription->channel);
  subscriptions_.emplace(subscription->id, std::move(subscription));
  answers_.send();
  if (why && !is_told_down_) on_links_down(*why);
  is_told_down_ = why.has_value();
}

void ClientChannels::unsubscribe(std::uint32_t id) {
  const auto found = subscriptions_.find(id);
  if (found == subscriptions_.end()) return answers_.refuse(unknown_id("subscription", id));
  hub_.unsubscribe(*found->second);
  output_.forget(*found->second);
  subscriptions_.erase(found);
  answers_.send_done();
}

std::optional<Refusal> ClientChannels::check_sending(const ipc::Advertise& request) const {
  if (request.queue() > limits_.publish_queue_max) {
    return Refusal{ipc::ERROR_LIMIT,
                   "a publisher's queue of " + std::to_string(request.queue()) +
                       " messages is longer than publish_queue_max under [limits] of the daemon's "
                       "configuration, " +
                       std::to_string(limits_.publish_queue_max) +
                       "; ask for a shorter one, or for none",
                   limits_.publish_queue_max};
  }
  if (request.has_copies() && (request.copies() == 0 || request.copies() > limits_.copies_max)) {
    return not_within("the number of copies", limits_.copies_max, "copies_max", request.copies());
  }
  if (request.has_copy_interval_ms() &&
      (request.copy_interval_ms() == 0 || request.copy_interval_ms() > kLongestCopyIntervalMs)) {
    return Refusal{ipc::ERROR_LIMIT,
                   "the interval of copies is 1 to " + std::to_string(kLongestCopyIntervalMs) +
                       " milliseconds",
                   kLongestCopyIntervalMs};
  }
  if (request.redundancy() > kMostRedundancy) {
    return Refusal{ipc::ERROR_LIMIT,
                   "a message has at most " + std::to_string(kMostRedundancy) + " repair packets",
                   kMostRedundancy};
  }
  return std::nullopt;
}

void ClientChannels::advertise(const ipc::Advertise& request) {
  if (publishers_.size() >= limits_.publishers_per_client) {
    return answers_.refuse(over_limit("a client's publishers", limits_.publishers_per_client,
                                      "publishers_per_client"));
  }
  if (const auto refusal = check_sending(request)) return answers_.refuse(*refusal);
  ChannelRequest channel = channel_request(request.channel());
  if (request.has_timestamped()) channel.is_timestamped = request.timestamped();
  auto publisher = std::make_unique<Publisher>();
  publisher->queue_limit = request.queue();
  publisher->drops_oldest = request.drop_oldest();
  publisher->copies = request.has_copies() ? request.copies() : 1;
  publisher->copy_interval_ms =
      request.has_copy_interval_ms() ? request.copy_interval_ms() : limits_.copy_interval_ms;
  publisher->redundancy =
      request.auto_redundancy() ? kAutoRedundancy : static_cast<std::uint8_t>(request.redundancy());
  publisher->sent_every = std::clamp(request.sent_every(), 1u, request.queue() + 1);
  publisher->client = this;
  publisher->id = ++last_id_;
  channel.ttl = request.ttl();
  if (const auto refusal = hub_.advertise(channel, *publisher)) return answers_.refuse(*refusal);
  const ChannelLimits limits = hub_.limits(publisher->channel);
  ipc::Advertised& reply = *answers_.make().mutable_advertised();
  reply.set_publisher_id(publisher->id);
  reply.set_channel(publisher->channel);
  reply.set_max_message_bytes(limits.message_bytes);
  reply.set_max_ttl(limits.ttl);
  reply.set_timestamped(limits.is_timestamped);
  if (publisher->redundancy != 0 && limits.has_redundancy) reply.set_has_redundancy(true);
  publishers_.emplace(publisher->id, std::move(publisher));
  answers_.send();
}

void ClientChannels::unadvertise(std::uint32_t id) {
  const auto found = publishers_.find(id);
  if (found == publishers_.end()) return answers_.refuse(unknown_id("publisher", id));
  hub_.unadvertise(*found->second);
  publishers_.erase(found);
  answers_.send_done();
}

void ClientChannels::publish(const ipc::PublishFrame& request) {
  const auto found = publishers_.find(request.publisher_id);
  if (found == publishers_.end()) {
    const Refusal refusal = unknown_id("publisher", request.publisher_id);
    return answers_.refuse_message(request.publisher_id, request.publish_number, refusal);
  }
  if (publish_bucket_.has_limit() && !publish_bucket_.take(monotonic_ns())) {
    ++counters_.messages_too_fast;
    note_refused(*found->second, 1);
    return answers_.refuse_message(found->first, request.publish_number,
                                   too_fast(limits_.publish_rate_hz));
  }
  const auto refusal = hub_.publish(*found->second, request.publish_number, request.payload,
                                    request.ttl, request.sent_at_ns);
  if (refusal) {
    note_refused(*found->second, 1);
    return answers_.refuse_message(found->first, request.publish_number, *refusal);
  }
  ++published_;
}

void ClientChannels::note_refused(const Publisher& publisher, std::uint32_t messages) {
  refused_ += messages;
  hub_.note_refused(publisher.channel, messages);
}

// No answer: it goes with messages, not with requests.
void ClientChannels::note_loss(const ipc::ClientLoss& loss) {
  counters_.deliveries_lost_in_client += loss.messages();
  lost_in_client_ += loss.messages();
  if (!loss.has_publisher_id()) return;
  const auto found = publishers_.find(loss.publisher_id());
  if (found == publishers_.end()) return;
  counters_.messages_busy_in_client += loss.refused();
  note_refused(*found->second, loss.refused());
}

void ClientChannels::fill(ipc::ClientStatus& status) const {
  status.set_subscriptions(static_cast<std::uint32_t>(subscriptions_.size()));
  status.set_publishers(static_cast<std::uint32_t>(publishers_.size()));
  std::size_t waiting = 0;
  for (const auto& [id, subscription] : subscriptions_) waiting += subscription->queue.size();
  status.set_queued_messages(static_cast<std::uint32_t>(waiting));
  status.set_lost_client(lost_in_client_);
  status.set_messages_published(published_);
  status.set_refused(refused_);
}

void ClientChannels::on_message(Subscription& subscription, const MessageRef& message) {
  output_.add_delivery(static_cast<QueuedSubscription&>(subscription), message);
}

void ClientChannels::on_sent(Publisher& publisher, std::uint64_t publish_number) {
  if (++publisher.untold_sent < publisher.sent_every) return;
  publisher.untold_sent = 0;
  answers_.tell_sent({publisher.id, publish_number});
}

void ClientChannels::on_unsent(std::uint32_t publisher_id, std::uint64_t publish_number,
                               const Refusal& refusal) {
  answers_.refuse_message(publisher_id, publish_number, refusal);
}

// Unasked: who only listens would wait in vain and not know why.
void ClientChannels::on_links_down(const Refusal& why) {
  is_told_down_ = true;
  ipc::Failure& failure = *answers_.make_notice().mutable_failure();
  failure.set_code(why.code);
  failure.set_text(text::plain(why.text));
  answers_.send_notice();
}

}  // namespace swarmtalk::daemon
