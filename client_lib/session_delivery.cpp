// Messages, from the daemon's frame to a program's callback: what waits here, what goes first, and
// how the program and the daemon are told of it.
#include <algorithm>
#include <utility>

#include "client_lib/convert.hpp"
#include "client_lib/session.hpp"

namespace swarmtalk::client {
namespace {

constexpr std::size_t kMostSpare = 256;           // messages kept to be used again
constexpr std::size_t kSparePayloadBytes = 1024;  // a larger one gives its memory back

bool is_too_old(const SubscriberState& subscriber, const Message& message) {
  if (!subscriber.policy.max_age || !message.received_at) return false;
  const auto age = Wakeup::Clock::now() - *message.received_at +
                   message.buffering_delay.value_or(std::chrono::microseconds(0));
  return age > *subscriber.policy.max_age;
}

}  // namespace

/// One of those that were handed over before, with its memory, or a new one.
std::unique_ptr<Message> Session::take_message() {
  if (spare_messages_.empty()) return std::make_unique<Message>();
  std::unique_ptr<Message> message = std::move(spare_messages_.back());
  spare_messages_.pop_back();
  return message;
}

void Session::give_back(std::unique_ptr<Message> message) {
  const bool is_small = message->payload.capacity() <= kSparePayloadBytes;
  if (is_small && spare_messages_.size() < kMostSpare) {
    spare_messages_.push_back(std::move(message));
  }
}

/// Behind what happened before it; the subscriber's policy may drop others of its messages.
void Session::wait_in_turn(const std::shared_ptr<SubscriberState>& subscriber,
                           const ipc::DeliverFrame& deliver) {
  std::unique_ptr<Message> message = take_message();
  convert(deliver, *message);
  auto& waiting = subscriber->waiting;
  const Policy& policy = subscriber->policy;
  const std::size_t before = waiting.size();
  if (policy.latest_of_each) {
    const auto same = std::find_if(waiting.begin(), waiting.end(), [&](const auto& other) {
      return other->sender == message->sender && other->epoch == message->epoch;
    });
    if (same != waiting.end()) {
      drop_waiting(*subscriber, static_cast<std::size_t>(same - waiting.begin()));
    }
  }
  if (policy.keep_last && waiting.size() >= std::max<std::uint32_t>(*policy.keep_last, 1)) {
    drop_waiting(*subscriber, 0);
  }
  message->lost_before += std::exchange(subscriber->lost, {});
  waiting.push_back(std::move(message));
  if (waiting.size() == before) return;  // its event is there
  if (subscriber->reads_ahead()) ++read_ahead_;
  post({Event::Kind::kMessage, subscriber, {}, {}});
}

/// Drops a message of the subscriber; the next one tells.
void Session::drop_waiting(SubscriberState& subscriber, std::size_t index) {
  const auto at = subscriber.waiting.begin() + static_cast<std::ptrdiff_t>(index);
  Loss lost = (*at)->lost_before;
  ++lost.client;
  give_back(std::move(*at));
  const auto next = subscriber.waiting.erase(at);
  (next != subscriber.waiting.end() ? (*next)->lost_before : subscriber.lost) += lost;
  note_loss(subscriber);
}

/// With its event: there is no room for more.
void Session::drop_oldest_message() {
  const auto oldest = std::find_if(events_.begin(), events_.end(), [](const Event& event) {
    return event.kind == Event::Kind::kMessage;
  });
  if (oldest == events_.end()) return;
  if (oldest->subscriber->reads_ahead()) --read_ahead_;
  drop_waiting(*oldest->subscriber, 0);
  events_.erase(oldest);
}

void Session::run_message(SubscriberState& subscriber) {
  if (subscriber.reads_ahead()) --read_ahead_;
  std::unique_ptr<Message> message = std::move(subscriber.waiting.front());
  subscriber.waiting.pop_front();
  if (subscriber.is_closed) return;
  if (is_too_old(subscriber, *message)) {
    subscriber.lost += message->lost_before;
    ++subscriber.lost.client;
    note_loss(subscriber);
  } else {
    hand_over(subscriber, *message);
  }
  give_back(std::move(message));
}

void Session::hand_over(SubscriberState& subscriber, Message& message) {
  if (subscriber.lost) message.lost_before += std::exchange(subscriber.lost, {});
  if (message.buffering_delay && message.received_at) {
    *message.buffering_delay += std::chrono::duration_cast<std::chrono::microseconds>(
        Wakeup::Clock::now() - *message.received_at);
  }
  if (message.lost_before && on_gap) {
    const auto callback = on_gap;  // it may replace itself
    callback(message);
  }
  if (!subscriber.is_closed && subscriber.receive) subscriber.receive(message);
}

void Session::note_loss(SubscriberState& subscriber) {
  ++subscriber.unreported_loss;
  has_unreported_loss_ = true;
}

/// The daemon counts what programs lose.
void Session::report_losses() {
  if (!std::exchange(has_unreported_loss_, false) || phase_ != Phase::kUp) return;
  for (const auto& subscriber : subscribers_) {
    const std::uint32_t lost = std::exchange(subscriber->unreported_loss, 0);
    if (lost == 0 || subscriber->id == 0) continue;
    outgoing_.Clear();
    ipc::ClientLoss& loss = *outgoing_.mutable_client_loss();
    loss.set_subscription_id(subscriber->id);
    loss.set_messages(lost);
    append(outgoing_);
  }
}

}  // namespace swarmtalk::client
