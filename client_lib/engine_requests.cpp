// What a program asks: registrations, poses, questions.
#include <cmath>
#include <cstdio>
#include <utility>

#include "client_lib/convert.hpp"
#include "client_lib/engine.hpp"
#include "client_lib/unread.hpp"

namespace swarmtalk::client {
namespace {

constexpr float kPoseMaxM = 32.767f;  // int16 millimetres on the air

}  // namespace

void Engine::flush_unless_gathering() {
  if (!is_processing_) flush();
}

Status Engine::require_connection() {
  if (!has_started_) return connect();
  if (phase_ == Phase::kUp) return Status();
  return last_failure_ ? Status(StatusCode::kDisconnected) : last_failure_;
}

/// Sends `outgoing_` as a request and waits for its reply.
Status Engine::ask(const std::function<void(const ipc::Envelope&)>& use) {
  bool is_answered = false;
  Status result;
  const auto id = requests_.send([&](const ipc::Envelope* reply, const Status& status) {
    is_answered = true;
    result = status;
    if (reply != nullptr) use(*reply);
  });
  const auto deadline = Wakeup::Clock::now() + options_.request_timeout;
  if (wait_until(deadline, [&] { return is_answered; })) return result;
  requests_.abandon(id);
  return Status(StatusCode::kTimeout);
}

Status Engine::get_status(DaemonStatus& status) {
  if (Status connection = require_connection(); !connection) return connection;
  requests_.make().mutable_get_status();
  return ask([&](const ipc::Envelope& reply) { convert(reply.status(), status); });
}

Status Engine::get_neighbours(std::vector<Neighbour>& neighbours) {
  if (Status connection = require_connection(); !connection) return connection;
  requests_.make().mutable_get_neighbours();
  return ask([&](const ipc::Envelope& reply) { convert(reply.neighbours(), neighbours); });
}

Status Engine::get_pose(std::optional<Pose>& pose) {
  pose.reset();
  if (Status connection = require_connection(); !connection) return connection;
  requests_.make().mutable_get_pose();
  return ask([&](const ipc::Envelope& reply) { pose = convert(reply.pose()); });
}

Status Engine::sync() {
  if (Status connection = require_connection(); !connection) return connection;
  const auto deadline = Wakeup::Clock::now() + options_.request_timeout;
  const bool is_done = wait_until(deadline, [this] { return requests_.is_empty() && !next_pose_; });
  const Status refusal = requests_.take_refusal();
  if (!is_done) return Status(StatusCode::kTimeout);
  return phase_ == Phase::kUp || !refusal ? refusal : Status(StatusCode::kDisconnected);
}

Status Engine::set_pose(const OwnPose& pose) {
  if (Status connection = require_connection(); !connection) return connection;
  const bool is_good = std::isfinite(pose.theta_rad) && std::fabs(pose.x_m) <= kPoseMaxM &&
                       std::fabs(pose.y_m) <= kPoseMaxM;  // false for NaN
  if (!is_good) {
    const Status status(StatusCode::kBadPose);
    deliveries_.report(status);
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

void Engine::send_pose(const OwnPose& pose) {
  ipc::SetPose& body = *requests_.make().mutable_set_pose();
  body.set_x_m(pose.x_m);
  body.set_y_m(pose.y_m);
  body.set_theta_rad(pose.theta_rad);
  if (pose.is_fixed) body.set_fixed(true);
  is_pose_in_flight_ = true;
  requests_.send([this](const ipc::Envelope*, const Status& status) {
    is_pose_in_flight_ = false;
    if (status.code() == StatusCode::kDisconnected) return;
    if (!status) {
      requests_.note_refusal(status);
      deliveries_.report(status);
    }
    if (const auto next = std::exchange(next_pose_, std::nullopt)) send_pose(*next);
  });
}

Status Engine::publish(PublisherState& publisher, std::string_view payload,
                       std::optional<std::uint32_t> ttl) {
  Status status = sender_.publish(publisher, payload, ttl,
                                  processing_thread_.load() == std::this_thread::get_id());
  if (status.code_ == StatusCode::kBusy) {
    status.unread_ = std::make_shared<Unread>(weak_from_this(), publisher.key->label, status.text_);
  }
  return status;
}

void Engine::tell_unread(const std::string& channel, const std::string& why) {
  const std::optional<Status> report = refusals_.note(channel, why);
  if (!report) return;
  reports_.add(*report);
  wakeup_.wake();
}

void Engine::remove(SubscriberState& subscriber) {
  if (!has_processed_ && subscriber.id != 0 && phase_ == Phase::kUp && refusals_.tells_stderr()) {
    std::fprintf(stderr,
                 "swarmtalk: %s was subscribed to and nothing was heard: call run() or process(), "
                 "callbacks are called in there only\n",
                 subscriber.key->label.c_str());
  }
  handles_.remove(subscriber);
}

std::shared_ptr<PublisherState> Engine::add_publisher(std::shared_ptr<const ChannelKey> key,
                                                      SentCallback sent, Sending sending) {
  auto publisher = std::make_shared<PublisherState>();
  publisher->session = weak_from_this();
  publisher->key = std::move(key);
  publisher->sent = std::move(sent);
  publisher->sending = sending;
  if (is_impossible(*publisher)) return publisher;
  handles_.add(publisher);
  register_new(*publisher, [&] { handles_.register_one(publisher); });
  return publisher;
}

std::shared_ptr<SubscriberState> Engine::add_subscriber(std::shared_ptr<const ChannelKey> key,
                                                        ReceiveCallback receive, Policy policy) {
  auto subscriber = std::make_shared<SubscriberState>();
  subscriber->session = weak_from_this();
  subscriber->key = std::move(key);
  subscriber->receive = std::move(receive);
  subscriber->policy = policy;
  if (is_impossible(*subscriber)) return subscriber;
  handles_.add(subscriber);
  register_new(*subscriber, [&] { handles_.register_one(subscriber); });
  return subscriber;
}

/// What no daemon could take is refused here: one frame that is not the protocol would cost the
/// client its connection, again and again.
bool Engine::is_impossible(HandleState& handle) {
  if (handle.key->problem) return false;
  handle.status = handle.key->problem;
  deliveries_.report(handle.status);
  return true;
}

void Engine::register_new(HandleState& handle, const std::function<void()>& register_now) {
  if (!has_started_) {
    if (const Status status = connect(); !status)
      deliveries_.report(status);  // registers it as well
    return;
  }
  if (phase_ != Phase::kUp && phase_ != Phase::kRegistering) return;
  register_now();
  const auto deadline = Wakeup::Clock::now() + options_.request_timeout;
  if (!wait_until(deadline, [&] { return handle.is_answered; })) {
    handle.status = Status(StatusCode::kTimeout);
    deliveries_.report(handle.status);
  }
}

}  // namespace swarmtalk::client
