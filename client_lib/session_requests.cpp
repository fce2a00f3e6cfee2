// What goes out to the daemon: registrations, publications, poses, questions.
#include <algorithm>
#include <cmath>
#include <utility>

#include "client_lib/convert.hpp"
#include "client_lib/session.hpp"

namespace swarmtalk::client {
namespace {

constexpr float kPoseMaxM = 32.767f;                             // int16 millimetres on the air
constexpr std::size_t kOutgoingMaxBytes = std::size_t{1} << 20;  // then send() answers kBusy
constexpr std::uint32_t kSentEveryMax = 64;
constexpr std::size_t kReportsMax = 16;  // of send(), until process()

void fill(ipc::Channel& channel, const ChannelKey& key) {
  if (key.number) {
    channel.set_number(*key.number);
  } else {
    channel.set_name(key.name);
  }
}

template <typename List>
void erase_handle(List& list, const HandleState& handle) {
  std::erase_if(list, [&](const auto& entry) { return entry.get() == &handle; });
}

}  // namespace

/// Sends `outgoing_` as a request.
std::uint32_t Session::request(Completion done) {
  if (++last_request_id_ == 0) ++last_request_id_;
  outgoing_.set_request_id(last_request_id_);
  if (!append(outgoing_)) {
    done(nullptr,
         Status(StatusCode::kBadArgument, "the request is longer than the protocol allows"));
    return last_request_id_;
  }
  pending_[last_request_id_] = std::move(done);
  return last_request_id_;
}

void Session::flush_unless_gathering() {
  if (!is_processing_) flush();
}

Status Session::require_connection() {
  if (!has_started_) return connect();
  if (phase_ == Phase::kUp) return Status();
  return last_failure_ ? Status(StatusCode::kDisconnected) : last_failure_;
}

/// Sends `outgoing_` as a request and waits for its reply.
Status Session::ask(const std::function<void(const ipc::Envelope&)>& use) {
  bool is_answered = false;
  Status result;
  const auto id = request([&](const ipc::Envelope* reply, const Status& status) {
    is_answered = true;
    result = status;
    if (reply != nullptr) use(*reply);
  });
  const auto deadline = Wakeup::Clock::now() + options_.request_timeout;
  if (wait_until(deadline, [&] { return is_answered; })) return result;
  pending_.erase(id);
  return Status(StatusCode::kTimeout);
}

Status Session::get_status(DaemonStatus& status) {
  if (Status connection = require_connection(); !connection) return connection;
  outgoing_.Clear();
  outgoing_.mutable_get_status();
  return ask([&](const ipc::Envelope& reply) { convert(reply.status(), status); });
}

Status Session::get_neighbours(std::vector<Neighbour>& neighbours) {
  if (Status connection = require_connection(); !connection) return connection;
  outgoing_.Clear();
  outgoing_.mutable_get_neighbours();
  return ask([&](const ipc::Envelope& reply) { convert(reply.neighbours(), neighbours); });
}

Status Session::get_pose(std::optional<Pose>& pose) {
  pose.reset();
  if (Status connection = require_connection(); !connection) return connection;
  outgoing_.Clear();
  outgoing_.mutable_get_pose();
  return ask([&](const ipc::Envelope& reply) { pose = convert(reply.pose()); });
}

Status Session::sync() {
  if (Status connection = require_connection(); !connection) return connection;
  const auto deadline = Wakeup::Clock::now() + options_.request_timeout;
  const bool is_done = wait_until(deadline, [this] { return pending_.empty() && !next_pose_; });
  const Status refusal = std::exchange(first_refusal_, Status());
  if (!is_done) return Status(StatusCode::kTimeout);
  return phase_ == Phase::kUp || !refusal ? refusal : Status(StatusCode::kDisconnected);
}

Status Session::set_pose(const OwnPose& pose) {
  if (Status connection = require_connection(); !connection) return connection;
  const bool is_good = std::isfinite(pose.theta_rad) && std::fabs(pose.x_m) <= kPoseMaxM &&
                       std::fabs(pose.y_m) <= kPoseMaxM;  // false for NaN
  if (!is_good) {
    const Status status(StatusCode::kBadPose);
    report(status);
    return status;
  }
  if (is_pose_in_flight_) {
    next_pose_ = pose;
  } else {
    send_pose(pose);
    flush_unless_gathering();
  }
  return phase_ == Phase::kUp ? Status() : Status(StatusCode::kDisconnected);
}

void Session::send_pose(const OwnPose& pose) {
  outgoing_.Clear();
  ipc::SetPose& body = *outgoing_.mutable_set_pose();
  body.set_x_m(pose.x_m);
  body.set_y_m(pose.y_m);
  body.set_theta_rad(pose.theta_rad);
  if (pose.is_fixed) body.set_fixed(true);
  is_pose_in_flight_ = true;
  request([this](const ipc::Envelope*, const Status& status) {
    is_pose_in_flight_ = false;
    if (status.code() == StatusCode::kDisconnected) return;
    if (!status) {
      if (first_refusal_) first_refusal_ = status;
      report(status);
    }
    if (const auto next = std::exchange(next_pose_, std::nullopt)) send_pose(*next);
  });
}

std::shared_ptr<PublisherState> Session::add_publisher(std::shared_ptr<const ChannelKey> key,
                                                       SentCallback sent, Sending sending) {
  auto publisher = std::make_shared<PublisherState>();
  publisher->session = weak_from_this();
  publisher->key = std::move(key);
  publisher->sent = std::move(sent);
  publisher->sending = sending;
  if (is_impossible(*publisher)) return publisher;
  publishers_.push_back(publisher);
  register_new(*publisher, [&] { register_publisher(publisher); });
  return publisher;
}

std::shared_ptr<SubscriberState> Session::add_subscriber(std::shared_ptr<const ChannelKey> key,
                                                         ReceiveCallback receive, Policy policy) {
  auto subscriber = std::make_shared<SubscriberState>();
  subscriber->session = weak_from_this();
  subscriber->key = std::move(key);
  subscriber->receive = std::move(receive);
  subscriber->policy = policy;
  if (is_impossible(*subscriber)) return subscriber;
  subscribers_.push_back(subscriber);
  register_new(*subscriber, [&] { register_subscriber(subscriber); });
  return subscriber;
}

/// What no daemon could take is refused here: one frame that is not the protocol would cost the
/// client its connection, again and again.
bool Session::is_impossible(HandleState& handle) {
  if (handle.key->problem) return false;
  handle.status = handle.key->problem;
  report(handle.status);
  return true;
}

void Session::register_new(HandleState& handle, const std::function<void()>& register_now) {
  if (!has_started_) {
    if (const Status status = connect(); !status) report(status);  // registers it as well
    return;
  }
  if (phase_ != Phase::kUp && phase_ != Phase::kRegistering) return;
  register_now();
  const auto deadline = Wakeup::Clock::now() + options_.request_timeout;
  if (!wait_until(deadline, [&] { return handle.is_answered; })) {
    handle.status = Status(StatusCode::kTimeout);
    report(handle.status);
  }
}

void Session::register_all() {
  phase_ = Phase::kRegistering;
  registrations_left_ = 1;  // ours, so that no answer ends the phase before all are asked
  for (const auto& subscriber : subscribers_) register_subscriber(subscriber);
  for (const auto& publisher : publishers_) register_publisher(publisher);
  if (--registrations_left_ == 0) become_up();
}

void Session::register_publisher(const std::shared_ptr<PublisherState>& publisher) {
  if (phase_ == Phase::kRegistering) ++registrations_left_;
  publisher->is_answered = false;
  outgoing_.Clear();
  ipc::Advertise& body = *outgoing_.mutable_advertise();
  fill(*body.mutable_channel(), *publisher->key);
  const ChannelOptions& options = publisher->key->options;
  if (options.ttl) body.set_ttl(*options.ttl);
  if (options.timestamped) body.set_timestamped(*options.timestamped);
  const Sending& sending = publisher->sending;
  if (sending.queue > 0) body.set_queue(sending.queue);
  if (sending.drop_oldest) body.set_drop_oldest(true);
  if (!publisher->sent && !sending.drop_oldest) {
    // Nobody waits for each: a wake-up saved for most. Three quarters of the queue stay free.
    publisher->sent_every = std::clamp((sending.queue + 1) / 4, 1u, kSentEveryMax);
    if (publisher->sent_every > 1) body.set_sent_every(publisher->sent_every);
  }
  if (sending.copies != 1) body.set_copies(sending.copies);
  if (sending.copy_interval) {
    body.set_copy_interval_ms(static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(sending.copy_interval->count(), 0, UINT32_MAX)));
  }
  request([this, publisher](const ipc::Envelope* reply, const Status& status) {
    if (reply != nullptr) {
      const ipc::Advertised& advertised = reply->advertised();
      if (publisher->is_closed) {
        unregister_publisher(advertised.publisher_id());
      } else {
        const std::lock_guard lock(gate_);
        publisher->id = advertised.publisher_id();
        publisher->channel = static_cast<std::uint16_t>(advertised.channel());
        publisher->max_message_bytes = advertised.max_message_bytes();
        publisher->max_ttl = advertised.max_ttl();
        publisher->tells_time = !advertised.has_timestamped() || advertised.timestamped();
        publishers_by_id_[publisher->id] = publisher;
      }
    }
    finish_registration(*publisher, status);
  });
}

void Session::register_subscriber(const std::shared_ptr<SubscriberState>& subscriber) {
  if (phase_ == Phase::kRegistering) ++registrations_left_;
  subscriber->is_answered = false;
  outgoing_.Clear();
  ipc::Subscribe& body = *outgoing_.mutable_subscribe();
  fill(*body.mutable_channel(), *subscriber->key);
  const Policy& policy = subscriber->policy;
  if (policy.keep_last) body.set_keep_last(*policy.keep_last);
  if (policy.max_distance_m) body.set_max_distance_m(*policy.max_distance_m);
  if (policy.drop_unknown_distance) body.set_drop_unknown_distance(true);
  if (policy.latest_of_each) body.set_latest_of_each(true);
  if (policy.max_age) {
    body.set_max_age_ms(static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(policy.max_age->count(), 0, UINT32_MAX)));
  }
  if (subscriber->key->options.timestamped) {
    body.set_timestamped(*subscriber->key->options.timestamped);
  }
  request([this, subscriber](const ipc::Envelope* reply, const Status& status) {
    if (reply != nullptr) {
      const ipc::Subscribed& subscribed = reply->subscribed();
      if (subscriber->is_closed) {
        unregister_subscriber(subscribed.subscription_id());
      } else {
        subscriber->id = subscribed.subscription_id();
        subscriber->channel = static_cast<std::uint16_t>(subscribed.channel());
        subscribers_by_id_[subscriber->id] = subscriber;
      }
    }
    finish_registration(*subscriber, status);
  });
}

void Session::finish_registration(HandleState& handle, const Status& status) {
  {
    const std::lock_guard lock(gate_);
    handle.is_answered = true;
    handle.status = status;
    if (status && handle.id == 0 && !handle.is_closed) {
      handle.status = Status(StatusCode::kProtocol);
    }
  }
  if (status.code() == StatusCode::kDisconnected) return;
  if (!handle.status && !handle.is_closed) report(handle.status);
  if (phase_ == Phase::kRegistering && --registrations_left_ == 0) become_up();
}

void Session::remove(PublisherState& publisher) {
  std::uint32_t id = 0;
  {
    const std::lock_guard lock(gate_);
    publisher.is_closed = true;
    id = std::exchange(publisher.id, 0);
  }
  publishers_by_id_.erase(id);
  if (id != 0) unregister_publisher(id);
  erase_handle(publishers_, publisher);
}

void Session::remove(SubscriberState& subscriber) {
  subscriber.is_closed = true;
  const auto id = std::exchange(subscriber.id, 0);
  subscribers_by_id_.erase(id);
  if (id != 0) unregister_subscriber(id);
  erase_handle(subscribers_, subscriber);
}

void Session::unregister_publisher(std::uint32_t id) {
  outgoing_.Clear();
  outgoing_.mutable_unadvertise()->set_publisher_id(id);
  request_done();
}

void Session::unregister_subscriber(std::uint32_t id) {
  outgoing_.Clear();
  outgoing_.mutable_unsubscribe()->set_subscription_id(id);
  request_done();
}

/// Sends `outgoing_` as a request whose answer nobody waits for, except sync().
void Session::request_done() {
  request([this](const ipc::Envelope*, const Status& status) {
    if (!status && first_refusal_) first_refusal_ = status;
  });
  flush_unless_gathering();
}

Status Session::check_publication(const PublisherState& publisher, std::size_t size_bytes,
                                  std::optional<std::uint32_t> ttl) const {
  if (publisher.id == 0) return publisher.status;
  if (size_bytes > publisher.max_message_bytes) {
    return Status(StatusCode::kTooLong, "the message has " + std::to_string(size_bytes) +
                                            " bytes; " + publisher.key->label +
                                            " carries at most " +
                                            std::to_string(publisher.max_message_bytes));
  }
  if (ttl && *ttl > publisher.max_ttl) {
    return Status(StatusCode::kBadTtl, "a TTL of " + std::to_string(*ttl) + "; " +
                                           publisher.key->label + " carries at most " +
                                           std::to_string(publisher.max_ttl));
  }
  return check_room(publisher);
}

/// Whether another message may be on its way.
Status Session::check_room(const PublisherState& publisher) const {
  if (connection_.outgoing_bytes() > kOutgoingMaxBytes) {
    return Status(StatusCode::kBusy, "swarmtalkd does not read what this program sends");
  }
  const Sending& sending = publisher.sending;
  if (sending.drop_oldest && sending.queue > 0) return Status();  // the daemon makes room
  return publisher.in_flight.size() > sending.queue ? Status(StatusCode::kBusy) : Status();
}

bool Session::is_busy(const PublisherState& publisher) {
  const std::lock_guard lock(gate_);
  return publisher.id != 0 && check_room(publisher).code() == StatusCode::kBusy;
}

/// Any thread: all that is used here is behind the gate. What only the owner can do, such as
/// waiting for a socket that is full or reading why it has died, it is rung for.
Status Session::publish(PublisherState& publisher, std::string_view payload,
                        std::optional<std::uint32_t> ttl) {
  const bool is_inside = processing_thread_.load() == std::this_thread::get_id();
  std::unique_lock lock(gate_);
  Status status = check_publication(publisher, payload.size(), ttl);
  if (status) status = append_publication(publisher, payload, ttl);
  const bool is_silent =
      status.code() != StatusCode::kTooLong && status.code() != StatusCode::kBadTtl;
  if (!is_silent && reports_.size() < kReportsMax) {
    reports_.push_back(status);
    has_reports_.store(true);
  }
  bool needs_owner = !is_silent;
  // Inside a callback: one write for all, at its end.
  if (status && !is_inside) {
    const bool is_written = connection_.flush().ok();
    needs_owner = !is_written || connection_.has_outgoing();
    if (!is_written) {
      publisher.in_flight.pop_back();
      status = Status(StatusCode::kDisconnected);
    }
  }
  lock.unlock();
  if (needs_owner && !is_inside) wakeup_.ring();
  return status;
}

Status Session::append_publication(PublisherState& publisher, std::string_view payload,
                                   std::optional<std::uint32_t> ttl) {
  ipc::PublishFrame frame;
  frame.publisher_id = publisher.id;
  frame.publish_number = publisher.publish_number + 1;
  frame.payload = payload;
  frame.ttl = ttl;
  if (publisher.tells_time) {
    const auto now = Wakeup::Clock::now().time_since_epoch();
    frame.sent_at_ns = static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  }
  if (!connection_.append(frame)) {
    return Status(StatusCode::kTooLong, "the message is longer than the local protocol carries");
  }
  publisher.in_flight.push_back(++publisher.publish_number);
  return Status();
}

}  // namespace swarmtalk::client
