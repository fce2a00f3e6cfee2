// Session: what each request does and how it is answered (ipc.proto).
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

#include "daemon/common/logging.hpp"
#include "daemon/common/monotonic_ns.hpp"
#include "daemon/common/printable.hpp"
#include "daemon/session/session.hpp"

namespace swarmtalk::daemon {
namespace {

ChannelRequest channel_request(const ipc::Channel& channel) {
  ChannelRequest request;
  request.name = channel.name();
  if (channel.has_number()) request.number = channel.number();
  return request;
}

constexpr std::uint32_t kLongestCopyIntervalMs = 10'000;
constexpr int kStatusCost = 32;              // as many cheap requests take as long
constexpr std::size_t kShownNameBytes = 64;  // of a client, in the status

Refusal unknown_id(const char* what, std::uint32_t id) {
  return {ipc::ERROR_UNKNOWN_ID,
          "this connection has no " + std::string(what) + " " + std::to_string(id), std::nullopt};
}

Refusal over_limit(const std::string& what, std::uint64_t limit) {
  return {ipc::ERROR_LIMIT,
          what + " is limited to " + std::to_string(limit) +
              " by [limits] of the daemon's configuration",
          limit};
}

Refusal too_fast(std::uint32_t rate_hz) {
  return {ipc::ERROR_RATE,
          "this client publishes more than " + std::to_string(rate_hz) +
              " messages per second, publish_rate_hz under [limits]; publish more slowly",
          rate_hz};
}

// A request of a newer minor looks like no request at all, but for fields that we do not know.
bool has_unknown_fields(const ipc::Envelope& request) {
  return request.GetReflection()->GetUnknownFields(request).field_count() > 0;
}

std::string version_text(std::uint32_t major, std::uint32_t minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

void Session::handle(const ipc::Envelope& request) {
  request_id_ = request.request_id();
  const int bodies = ipc::count_bodies(request);
  if (bodies > 1 || (bodies == 0 && !has_unknown_fields(request))) {
    is_malformed_ = true;
    fail_stream(ipc::ERROR_MALFORMED,
                "a frame has exactly one submessage, this one has " + std::to_string(bodies));
  } else if (request.has_hello()) {
    greet(request.hello());
  } else if (!has_greeted_) {
    is_malformed_ = true;
    fail_stream(ipc::ERROR_MALFORMED, "the first frame must be Hello");
  } else if (request.has_publish()) {
    publish(ipc::frame_of(request.publish()));
  } else if (request.has_client_loss()) {
    note_loss(request.client_loss());
  } else if (request.has_set_pose()) {
    set_pose(request.set_pose());
  } else if (request.has_subscribe()) {
    subscribe(request.subscribe());
  } else if (request.has_unsubscribe()) {
    unsubscribe(request.unsubscribe().subscription_id());
  } else if (request.has_advertise()) {
    advertise(request.advertise());
  } else if (request.has_unadvertise()) {
    unadvertise(request.unadvertise().publisher_id());
  } else if (request.has_get_pose()) {
    get_pose();
  } else if (request.has_get_status()) {
    requests_left_ -= kStatusCost;
    host_.fill_status(*new_reply().mutable_status());
    send_reply();
  } else if (request.has_get_neighbours()) {
    requests_left_ -= kStatusCost;
    host_.fill_neighbours(*new_reply().mutable_neighbours());
    send_reply();
  } else if (request.has_kilobot_command()) {
    begin_kilobot(request.kilobot_command());
  } else if (request.has_kilobot_cancel()) {
    cancel_kilobot(request.kilobot_cancel().operation_id());
  } else if (!operate(request)) {
    refuse({ipc::ERROR_UNSUPPORTED, "this daemon does not know this request", std::nullopt});
  }
}

void Session::greet(const ipc::Hello& hello) {
  if (hello.major() != ipc::kProtocolMajor) {
    ++host_.counters.clients_other_version;
    fail_stream(ipc::ERROR_VERSION,
                "the client speaks protocol " + version_text(hello.major(), hello.minor()) +
                    ", this daemon " + version_text(ipc::kProtocolMajor, ipc::kProtocolMinor) +
                    "; install client and daemon of one release");
    return;
  }
  const bool is_first = !std::exchange(has_greeted_, true);
  client_name_ = printable(hello.name());
  ipc::Hello& reply = *new_reply().mutable_hello();
  host_.fill_hello(reply);
  if (is_first && host_.limits.ring_bytes > 0 && ipc::has_feature(hello, ipc::kRingFeature)) {
    if (input_.begin_ring(host_.limits.ring_bytes)) {
      reply.add_features(ipc::kRingFeature);
    } else {
      log_of("client")->debug("{}: no memory for a ring: {}", who(), std::strerror(errno));
    }
  }
  send_reply();
}

void Session::subscribe(const ipc::Subscribe& request) {
  if (subscriptions_.size() >= host_.limits.subscriptions_per_client) {
    return refuse(over_limit("the number of subscriptions of one client",
                             host_.limits.subscriptions_per_client));
  }
  const std::uint32_t keep_last =
      request.has_keep_last() ? request.keep_last() : host_.limits.queue_messages;
  if (keep_last == 0 || keep_last > host_.limits.queue_messages_max) {
    return refuse(over_limit("keep_last begins at 1 and", host_.limits.queue_messages_max));
  }
  if (request.has_max_distance_m() && !(request.max_distance_m() >= 0.0f)) {  // or NaN
    return refuse({ipc::ERROR_BAD_DISTANCE,
                   "max_distance_m is metres, 0 or more; leave it out for any distance",
                   std::nullopt});
  }
  if (request.has_max_age_ms() && request.max_age_ms() == 0) {  // would drop everything
    return refuse({ipc::ERROR_BAD_ARGUMENT,
                   "a message's greatest age begins at 1 millisecond; leave it out for any age",
                   std::nullopt});
  }
  auto subscription = std::make_unique<QueuedSubscription>(keep_last, request.latest_of_each());
  if (request.has_max_age_ms()) subscription->max_age_ms = request.max_age_ms();
  subscription->client = this;
  subscription->id = ++last_id_;
  if (request.has_max_distance_m()) subscription->max_distance_m = request.max_distance_m();
  subscription->drops_unknown_distance = request.drop_unknown_distance();
  ChannelRequest channel = channel_request(request.channel());
  if (request.has_timestamped()) channel.is_timestamped = request.timestamped();
  if (const auto refusal = host_.hub.subscribe(channel, *subscription)) return refuse(*refusal);
  ipc::Subscribed& reply = *new_reply().mutable_subscribed();
  reply.set_subscription_id(subscription->id);
  reply.set_channel(subscription->channel);
  const auto why = host_.hub.links_down(subscription->channel);
  subscriptions_.emplace(subscription->id, std::move(subscription));
  send_reply();
  if (why && !is_told_down_) on_links_down(*why);
  is_told_down_ = why.has_value();
}

// Unasked: who only listens would wait in vain and not know why.
void Session::on_links_down(const Refusal& why) {
  is_told_down_ = true;
  ipc::Failure& failure = *new_notice().mutable_failure();
  failure.set_code(why.code);
  failure.set_text(why.text);
  send_notice();
}

void Session::unsubscribe(std::uint32_t id) {
  const auto found = subscriptions_.find(id);
  if (found == subscriptions_.end()) return refuse(unknown_id("subscription", id));
  host_.hub.unsubscribe(*found->second);
  forget(*found->second);
  subscriptions_.erase(found);
  new_reply().mutable_done();
  send_reply();
}

std::optional<Refusal> Session::check_sending(const ipc::Advertise& request) const {
  const LimitsConfig& limits = host_.limits;
  if (request.queue() > limits.publish_queue_max) {
    return over_limit("the queue of a publisher", limits.publish_queue_max);
  }
  if (request.has_copies() && (request.copies() == 0 || request.copies() > limits.copies_max)) {
    return over_limit("the number of copies begins at 1 and", limits.copies_max);
  }
  if (request.has_copy_interval_ms() &&
      (request.copy_interval_ms() == 0 || request.copy_interval_ms() > kLongestCopyIntervalMs)) {
    return Refusal{ipc::ERROR_LIMIT,
                   "the interval of copies is 1 to " + std::to_string(kLongestCopyIntervalMs) +
                       " milliseconds",
                   kLongestCopyIntervalMs};
  }
  return std::nullopt;
}

void Session::advertise(const ipc::Advertise& request) {
  if (publishers_.size() >= host_.limits.publishers_per_client) {
    return refuse(
        over_limit("the number of publishers of one client", host_.limits.publishers_per_client));
  }
  if (const auto refusal = check_sending(request)) return refuse(*refusal);
  ChannelRequest channel = channel_request(request.channel());
  if (request.has_timestamped()) channel.is_timestamped = request.timestamped();
  auto publisher = std::make_unique<Publisher>();
  publisher->queue_limit = request.queue();
  publisher->drops_oldest = request.drop_oldest();
  publisher->copies = request.has_copies() ? request.copies() : 1;
  publisher->copy_interval_ms =
      request.has_copy_interval_ms() ? request.copy_interval_ms() : host_.limits.copy_interval_ms;
  publisher->sent_every = std::clamp(request.sent_every(), 1u, request.queue() + 1);
  publisher->client = this;
  publisher->id = ++last_id_;
  channel.ttl = request.ttl();
  if (const auto refusal = host_.hub.advertise(channel, *publisher)) return refuse(*refusal);
  const ChannelLimits limits = host_.hub.limits(publisher->channel);
  ipc::Advertised& reply = *new_reply().mutable_advertised();
  reply.set_publisher_id(publisher->id);
  reply.set_channel(publisher->channel);
  reply.set_max_message_bytes(limits.message_bytes);
  reply.set_max_ttl(limits.ttl);
  reply.set_timestamped(limits.is_timestamped);
  publishers_.emplace(publisher->id, std::move(publisher));
  send_reply();
}

void Session::unadvertise(std::uint32_t id) {
  const auto found = publishers_.find(id);
  if (found == publishers_.end()) return refuse(unknown_id("publisher", id));
  host_.hub.unadvertise(*found->second);
  publishers_.erase(found);
  new_reply().mutable_done();
  send_reply();
}

void Session::publish(const ipc::PublishFrame& request) {
  const auto found = publishers_.find(request.publisher_id);
  if (found == publishers_.end()) {
    const Refusal refusal = unknown_id("publisher", request.publisher_id);
    return on_unsent(request.publisher_id, request.publish_number, refusal);
  }
  if (publish_bucket_.has_limit() && !publish_bucket_.take(monotonic_ns())) {
    ++host_.counters.messages_too_fast;
    return on_unsent(found->first, request.publish_number, too_fast(host_.limits.publish_rate_hz));
  }
  const auto refusal = host_.hub.publish(*found->second, request.publish_number, request.payload,
                                         request.ttl, request.sent_at_ns);
  if (refusal) return on_unsent(found->first, request.publish_number, *refusal);
  ++published_;
}

// No answer: it goes with messages, not with requests.
void Session::note_loss(const ipc::ClientLoss& loss) {
  host_.counters.deliveries_lost_in_client += loss.messages();
  lost_in_client_ += loss.messages();
}

void Session::fill(ipc::ClientStatus& status) const {
  status.set_name(client_name_.substr(0, kShownNameBytes));
  status.set_pid(pid_);
  status.set_uid(uid_);
  status.set_subscriptions(static_cast<std::uint32_t>(subscriptions_.size()));
  status.set_publishers(static_cast<std::uint32_t>(publishers_.size()));
  std::size_t waiting = 0;
  for (const auto& [id, subscription] : subscriptions_) waiting += subscription->queue.size();
  status.set_queued_messages(static_cast<std::uint32_t>(waiting));
  status.set_queued_bytes(queued_bytes_ + (output_.size() - written_) + replies_.size());
  status.set_deliveries_sent(deliveries_sent_);
  status.set_lost_daemon(lost_here_);
  status.set_lost_client(lost_in_client_);
  status.set_messages_published(published_);
}

void Session::set_pose(const ipc::SetPose& request) {
  std::optional<Time> known_at = std::chrono::steady_clock::now();
  if (request.fixed()) known_at.reset();
  if (!host_.poses.set(request.x_m(), request.y_m(), request.theta_rad(), known_at)) {
    return refuse({ipc::ERROR_BAD_POSE,
                   "a pose is x and y in metres, -32.767 to 32.767, and a finite angle in radians",
                   std::nullopt});
  }
  new_reply().mutable_done();
  send_reply();
}

void Session::get_pose() {
  const auto now = std::chrono::steady_clock::now();
  ipc::Pose& reply = *new_reply().mutable_pose();
  if (const auto age_ms = host_.poses.age_ms(now)) reply.set_age_ms(*age_ms);
  if (const auto pose = host_.poses.valid(now)) {
    reply.set_x_m(static_cast<float>(pose->x_m));
    reply.set_y_m(static_cast<float>(pose->y_m));
    reply.set_theta_rad(static_cast<float>(pose->theta_rad));
  }
  send_reply();
}

void Session::refuse(const Refusal& refusal) {
  ++host_.counters.requests_refused;
  ipc::Failure& failure = *new_reply().mutable_failure();
  failure.set_code(refusal.code);
  failure.set_text(refusal.text);
  if (refusal.limit) failure.set_limit(*refusal.limit);
  send_reply();
}

ipc::Envelope& Session::new_reply() {
  host_.reply.Clear();
  if (request_id_ != 0) host_.reply.set_request_id(request_id_);
  return host_.reply;
}

ipc::Envelope& Session::new_notice() {
  host_.notice.Clear();
  return host_.notice;
}

void Session::on_sent(Publisher& publisher, std::uint64_t publish_number) {
  if (++publisher.untold_sent < publisher.sent_every) return;
  publisher.untold_sent = 0;
  ipc::Sent& sent = *new_notice().mutable_sent();
  sent.set_publisher_id(publisher.id);
  sent.set_publish_number(publish_number);
  send_notice();
}

void Session::on_unsent(std::uint32_t publisher_id, std::uint64_t publish_number,
                        const Refusal& refusal) {
  ++host_.counters.requests_refused;
  ipc::Failure& failure = *new_notice().mutable_failure();
  failure.set_code(refusal.code);
  failure.set_text(refusal.text);
  if (refusal.limit) failure.set_limit(*refusal.limit);
  failure.set_publisher_id(publisher_id);
  failure.set_publish_number(publish_number);
  send_notice();
}

}  // namespace swarmtalk::daemon
