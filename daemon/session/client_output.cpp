#include "daemon/session/client_output.hpp"

#include <algorithm>

#include "daemon/common/monotonic_ns.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kOutputBytes = 64 * 1024;  // deliveries committed to one write
constexpr std::size_t kBytesOfAMessage = 512;    // of queue_bytes: so many may wait without any
constexpr std::size_t kLeastMessages = 64;

std::uint32_t age_ms(const frame::FramePose& pose) {
  return pose.age_10ms * 10u;
}

std::uint32_t cut(std::uint64_t count) {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(count, UINT32_MAX));
}

ipc::DeliverLost lost_of(const Loss& lost) {
  return {cut(lost.air), cut(lost.kernel), cut(lost.daemon), cut(lost.late)};
}

/// Instead of an answer that fits no frame: of a status, say, with thousands of channels.
ipc::Envelope too_long(std::uint32_t request_id) {
  ipc::Envelope envelope;
  envelope.set_request_id(request_id);
  ipc::Failure& failure = *envelope.mutable_failure();
  failure.set_code(ipc::ERROR_LIMIT);
  failure.set_limit(ipc::kMaxEnvelopeBytes);
  failure.set_text("the answer is longer than the " + std::to_string(ipc::kMaxEnvelopeBytes) +
                   " bytes of a frame; let programs use fewer channels");
  return envelope;
}

/// Refers to the message.
ipc::DeliverFrame frame_of(const Message& message) {
  ipc::DeliverFrame frame;
  frame.payload = message.payload;
  frame.channel = message.channel;
  frame.sender = message.sender;
  frame.epoch = message.epoch;
  frame.message_number = message.number;
  if (message.distance_m == message.distance_m) frame.distance_m = message.distance_m;
  if (message.bearing_rad == message.bearing_rad) frame.bearing_rad = message.bearing_rad;
  if (message.sender_pose && !message.sender_pose->is_stale()) {
    const frame::FramePose& pose = *message.sender_pose;
    frame.sender_pose = {static_cast<float>(pose.x_m()), static_cast<float>(pose.y_m()),
                         static_cast<float>(pose.theta_rad()), age_ms(pose)};
  }
  frame.hops = message.hops;
  frame.transmitter = message.transmitter;
  frame.ttl = message.ttl;
  if (message.is_time_known) {
    frame.buffering_delay_us = message.buffering_delay_us;
    frame.received_at_ns = message.received_at_ns;
  }
  frame.local = message.is_local;
  if (message.crossed_gateway) frame.origin.emplace();
  if (message.crossed_gateway && message.origin) {
    frame.origin = {message.origin->link, message.origin->node, message.origin->number};
  }
  return frame;
}

}  // namespace

void ClientOutput::add_answer(const ipc::Envelope& answer) {
  if (is_closed_) return;
  if (!ipc::append_frame(answer, answers_)) {
    ipc::append_frame(too_long(answer.request_id()), answers_);
  }
  wake_();
}

void ClientOutput::add_answer(const ipc::SentFrame& answer) {
  if (is_closed_) return;
  ipc::append_frame(answer, answers_);  // of three numbers
  wake_();
}

void ClientOutput::begin_change(const SubscriptionQueue& queue) {
  queued_bytes_ -= queue.payload_bytes();
  queued_messages_ -= queue.size();
}

void ClientOutput::end_change(const SubscriptionQueue& queue) {
  queued_bytes_ += queue.payload_bytes();
  queued_messages_ += queue.size();
}

// A message of no bytes needs memory too.
bool ClientOutput::is_over(std::size_t more_bytes) const {
  if (queued_bytes_ + more_bytes > limits_.queue_bytes) return true;
  return queued_messages_ >= kLeastMessages &&
         queued_messages_ * kBytesOfAMessage >= limits_.queue_bytes;
}

void ClientOutput::add_delivery(QueuedSubscription& subscription, const MessageRef& message) {
  SubscriptionQueue& queue = subscription.queue;
  const std::size_t size_bytes = message->payload.size();
  queue.note(std::exchange(subscription.lost, {}));
  while (!queue.is_empty() && is_over(size_bytes)) {
    begin_change(queue);
    queue.drop_oldest();
    end_change(queue);
    ++counters_.deliveries_dropped_bytes;
    ++lost_;
  }
  if (is_over(size_bytes)) {
    queue.count_dropped();
    ++counters_.deliveries_dropped_bytes;
    ++lost_;
    return;
  }
  begin_change(queue);
  if (queue.push(message)) {
    ++counters_.deliveries_dropped_full;
    ++lost_;
  }
  end_change(queue);
  if (std::exchange(subscription.is_ready, true)) return;  // on its way out already
  ready_.push_back(&subscription);
  wake_();
}

void ClientOutput::forget(QueuedSubscription& subscription) {
  counters_.deliveries_dropped_closed += subscription.queue.size();
  begin_change(subscription.queue);
  std::erase(ready_, &subscription);
}

// Deliveries that the socket has not taken yet go behind the answers; only what was an answer
// before, and the rest of a frame that has been begun, stays in front.
void ClientOutput::put_answers_ahead() {
  if (answers_.empty() || written_ == bytes_.size()) return;
  if (bytes_.size() > kOutputBytes + limits_.reply_bytes) return;  // they wait in answers_
  while (answers_end_ < written_) {
    answers_end_ += ipc::frame_bytes(bytes_.data() + answers_end_);
  }
  bytes_.insert(answers_end_, answers_);
  answers_end_ += answers_.size();
  answers_.clear();
}

bool ClientOutput::refill() {
  bytes_.clear();
  written_ = 0;
  bytes_.swap(answers_);
  answers_end_ = bytes_.size();
  const std::uint64_t now_ns = ready_.empty() ? 0 : monotonic_ns();
  while (!ready_.empty() && bytes_.size() < kOutputBytes) {
    QueuedSubscription& subscription = *ready_.front();
    ready_.pop_front();
    if (subscription.max_age_ms) drop_old(subscription, now_ns);
    if (!subscription.queue.is_empty()) append(subscription);
    subscription.is_ready = !subscription.queue.is_empty();
    if (subscription.is_ready) ready_.push_back(&subscription);
  }
  return !bytes_.empty();
}

// Old by the time since the kernel received it, and on the way before where that is known.
void ClientOutput::drop_old(QueuedSubscription& subscription, std::uint64_t now_ns) {
  const std::uint64_t limit_ns = std::uint64_t{*subscription.max_age_ms} * 1'000'000;
  SubscriptionQueue& queue = subscription.queue;
  begin_change(queue);
  while (!queue.is_empty()) {
    const Message& oldest = queue.front();
    const std::uint64_t before_ns = std::uint64_t{oldest.buffering_delay_us.value_or(0)} * 1000;
    if (now_ns <= oldest.received_at_ns + limit_ns - std::min(limit_ns, before_ns)) break;
    queue.drop_oldest();
    ++counters_.deliveries_dropped_old;
    ++lost_;
  }
  end_change(queue);
}

void ClientOutput::append(QueuedSubscription& subscription) {
  const SubscriptionQueue::Taken taken = subscription.queue.pop();
  const Message& message = *taken.message;
  queued_bytes_ -= message.payload.size();
  --queued_messages_;
  ipc::DeliverFrame frame = frame_of(message);
  frame.subscription_id = subscription.id;
  frame.lost_before = lost_of(taken.lost_before);
  ipc::append_frame(frame, bytes_);  // 16 KiB of payload always fit
  ++counters_.deliveries_sent;
  ++deliveries_sent_;
}

}  // namespace swarmtalk::daemon
