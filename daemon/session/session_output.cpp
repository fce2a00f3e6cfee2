// Session's output side: replies first, then deliveries, subscriptions in turn; one buffer, written
// when the turn of the event loop ends.
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "daemon/common/logging.hpp"
#include "daemon/common/monotonic_ns.hpp"
#include "daemon/session/session.hpp"
#include "ipc/pass_descriptor.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kOutputBytes = 64 * 1024;  // deliveries committed to one write
constexpr int kWritesPerTurn = 8;                // then the other sessions have their turn

std::uint32_t age_ms(const frame::FramePose& pose) {
  return pose.age_10ms * 10u;
}

std::uint32_t cut(std::uint64_t count) {
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(count, UINT32_MAX));
}

ipc::DeliverLost lost_of(const Loss& lost) {
  return {cut(lost.air), cut(lost.kernel), cut(lost.daemon), cut(lost.late)};
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

void Session::append_reply(const ipc::Envelope& reply) {
  if (is_closed_) return;
  if (!ipc::append_frame(reply, replies_)) {
    doom_ = "a reply did not fit into a frame";
  } else if (replies_.size() > host_.limits.reply_bytes && doom_.empty()) {
    ++host_.counters.clients_not_reading;
    doom_ = "it does not read its replies: " + std::to_string(replies_.size()) +
            " bytes wait, limits.reply_bytes is " + std::to_string(host_.limits.reply_bytes);
  }
  if (is_flush_scheduled_ || (is_waiting_writable_ && doom_.empty())) return;
  is_flush_scheduled_ = true;
  host_.schedule_flush(shared_from_this());
}

void Session::on_message(Subscription& subscription, const MessageRef& message) {
  auto& queued = static_cast<QueuedSubscription&>(subscription);
  const std::size_t size_bytes = message->payload.size();
  queued.queue.note(std::exchange(subscription.lost, {}));
  while (!queued.queue.is_empty() && queued_bytes_ + size_bytes > host_.limits.queue_bytes) {
    queued_bytes_ -= queued.queue.payload_bytes();
    queued.queue.drop_oldest();
    queued_bytes_ += queued.queue.payload_bytes();
    ++host_.counters.deliveries_dropped_bytes;
    ++lost_here_;
  }
  if (queued_bytes_ + size_bytes > host_.limits.queue_bytes) {
    queued.queue.count_dropped();
    ++host_.counters.deliveries_dropped_bytes;
    ++lost_here_;
    return;
  }
  queued_bytes_ -= queued.queue.payload_bytes();
  if (queued.queue.push(message)) {
    ++host_.counters.deliveries_dropped_full;
    ++lost_here_;
  }
  queued_bytes_ += queued.queue.payload_bytes();
  if (!std::exchange(queued.is_ready, true)) ready_.push_back(&queued);
  if (is_flush_scheduled_ || is_waiting_writable_) return;
  is_flush_scheduled_ = true;
  host_.schedule_flush(shared_from_this());
}

void Session::forget(QueuedSubscription& subscription) {
  host_.counters.deliveries_dropped_closed += subscription.queue.size();
  queued_bytes_ -= subscription.queue.payload_bytes();
  std::erase(ready_, &subscription);
}

void Session::flush() {
  is_flush_scheduled_ = false;
  if (is_closed_) return;
  if (!doom_.empty() && !closes_when_written_) return close(doom_);
  if (is_waiting_writable_) return;
  put_replies_ahead();
  for (int i = 0; i < kWritesPerTurn; ++i) {
    if (written_ == output_.size()) {
      fill_output();
      if (output_.empty()) break;
    }
    if (!write_once()) return;
  }
  if (written_ == output_.size() && closes_when_written_) {
    if (!is_refused_) return close(doom_, is_malformed_);
    shutdown(socket_.native_handle(), SHUT_WR);
    return discard_input();
  }
  const bool has_more = written_ < output_.size() || !replies_.empty() || !ready_.empty();
  if (!has_more) return;
  is_flush_scheduled_ = true;
  host_.schedule_flush(shared_from_this());
}

// Deliveries that the socket has not taken yet go behind the replies; only what was a reply before,
// and the rest of a frame that has been begun, stays in front.
void Session::put_replies_ahead() {
  if (replies_.empty() || written_ == output_.size()) return;
  if (output_.size() > kOutputBytes + host_.limits.reply_bytes) return;  // they wait in replies_
  while (replies_end_ < written_) {
    replies_end_ += ipc::frame_bytes(output_.data() + replies_end_);
  }
  output_.insert(replies_end_, replies_);
  replies_end_ += replies_.size();
  replies_.clear();
}

void Session::fill_output() {
  output_.clear();
  written_ = 0;
  output_.swap(replies_);
  replies_end_ = output_.size();
  const std::uint64_t now_ns = ready_.empty() ? 0 : monotonic_ns();
  while (!ready_.empty() && output_.size() < kOutputBytes) {
    QueuedSubscription& subscription = *ready_.front();
    ready_.pop_front();
    if (subscription.max_age_ms) drop_old(subscription, now_ns);
    if (!subscription.queue.is_empty()) append_delivery(subscription);
    subscription.is_ready = !subscription.queue.is_empty();
    if (subscription.is_ready) ready_.push_back(&subscription);
  }
}

// Old by the time since the kernel received it, and on the way before where that is known.
void Session::drop_old(QueuedSubscription& subscription, std::uint64_t now_ns) {
  const std::uint64_t limit_ns = std::uint64_t{*subscription.max_age_ms} * 1'000'000;
  SubscriptionQueue& queue = subscription.queue;
  queued_bytes_ -= queue.payload_bytes();
  while (!queue.is_empty()) {
    const Message& oldest = queue.front();
    const std::uint64_t before_ns = std::uint64_t{oldest.buffering_delay_us.value_or(0)} * 1000;
    if (now_ns <= oldest.received_at_ns + limit_ns - std::min(limit_ns, before_ns)) break;
    queue.drop_oldest();
    ++host_.counters.deliveries_dropped_old;
    ++lost_here_;
  }
  queued_bytes_ += queue.payload_bytes();
}

void Session::append_delivery(QueuedSubscription& subscription) {
  const SubscriptionQueue::Taken taken = subscription.queue.pop();
  const Message& message = *taken.message;
  queued_bytes_ -= message.payload.size();
  ipc::DeliverFrame frame = frame_of(message);
  frame.subscription_id = subscription.id;
  frame.lost_before = lost_of(taken.lost_before);
  ipc::append_frame(frame, output_);  // 16 KiB of payload always fit
  ++host_.counters.deliveries_sent;
  ++deliveries_sent_;
}

// The ring's memory goes with the first byte of all, which is that of our hello.
ssize_t Session::write_some() {
  const int descriptor = input_.descriptor_to_pass();
  const char* bytes = output_.data() + written_;
  const std::size_t size = output_.size() - written_;
  if (descriptor < 0) {
    return send(socket_.native_handle(), bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  const ssize_t sent = ipc::send_with_descriptor(socket_.native_handle(), bytes, size, descriptor);
  if (sent > 0) input_.descriptor_is_passed();
  return sent;
}

// The kernel limits the descriptors on their way of all a user's processes together (ETOOMANYREFS):
// clients that keep theirs unread must not lock others out. Our hello, of which nothing is written
// yet, then offers no ring.
void Session::withdraw_ring() {
  log_of("client")->debug("{}: no ring, it cannot be passed: {}", who(), std::strerror(errno));
  input_.withdraw_ring();
  const std::size_t size = ipc::frame_bytes(output_.data());
  std::string frame;
  host_.reply.ParseFromArray(output_.data() + ipc::kLengthBytes,
                             static_cast<int>(size - ipc::kLengthBytes));
  host_.reply.mutable_hello()->clear_features();
  ipc::append_frame(host_.reply, frame);
  output_.replace(0, size, frame);
  replies_end_ = replies_end_ - size + frame.size();
}

bool Session::write_once() {
  const ssize_t sent = write_some();
  if (sent >= 0) {
    written_ += static_cast<std::size_t>(sent);
    return true;
  }
  if (errno == EINTR) return true;
  if (input_.descriptor_to_pass() >= 0 && (errno == ETOOMANYREFS || errno == ENOMEM)) {
    withdraw_ring();
    return true;
  }
  if (errno != EAGAIN && errno != EWOULDBLOCK) {
    close(errno == EPIPE ? "it closed the connection" : std::strerror(errno));
  } else if (closes_when_written_) {
    close(doom_, is_malformed_);  // it does not read what was wrong either
  } else {
    wait_writable();
  }
  return false;
}

void Session::wait_writable() {
  is_waiting_writable_ = true;
  socket_.async_wait(boost::asio::posix::stream_descriptor::wait_write,
                     [self = shared_from_this()](const boost::system::error_code& error) {
                       self->is_waiting_writable_ = false;
                       if (!error) self->flush();
                     });
}

}  // namespace swarmtalk::daemon
