#include "client_lib/deliveries.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "client_lib/convert.hpp"
#include "client_lib/wakeup.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {
namespace {

constexpr std::size_t kEventsMax = 4096;  // kept while a call waits; then the oldest message goes
constexpr std::size_t kMostSpare = 256;   // messages kept to be used again
constexpr std::size_t kSparePayloadBytes = 1024;  // a larger one gives its memory back

bool is_too_old(const SubscriberState& subscriber, const Message& message) {
  if (!subscriber.policy.max_age || !message.received_at) return false;
  const auto age = loop::now() - *message.received_at +
                   message.buffering_delay.value_or(std::chrono::microseconds(0));
  return age > *subscriber.policy.max_age;
}

/// Of a message: not that the connection was lost, which is told by itself, nor as the program
/// asked.
bool is_failure(const Status& status) {
  return !status && status.code() != StatusCode::kDisconnected &&
         status.code() != StatusCode::kDropped;
}

void print(std::string_view text) {
  std::fprintf(stderr, "swarmtalk: %.*s\n", static_cast<int>(text.size()), text.data());
}

void tell(Deliveries::Told& cause, Wakeup::Clock::time_point now, bool is_last = false) {
  std::string text = cause.text;
  if (cause.untold > 1 || is_last) {
    text += " (" + std::to_string(cause.untold) + (cause.untold > 1 ? " times" : " time") +
            " since the last line)";
  }
  print(text);
  cause.at = now;
  cause.untold = 0;
}

}  // namespace

Deliveries::Deliveries(Reports& reports, std::function<void()> wake)
    : reports_(reports), wake_(std::move(wake)) {
  set_default_callbacks();
}

void Deliveries::close(bool tells_stderr) {
  if (tells_stderr) print_failures();
  is_closed_ = true;
  events_.clear();
  read_ahead_ = 0;
}

/// Each once, with how often it happened.
void Deliveries::print_failures() {
  if (reports_.has_any()) take_reports();
  for (auto& [code, cause] : *told_) {
    if (cause.untold > 0) tell(cause, {}, true);
  }
  std::vector<std::pair<std::string, std::size_t>> failures;
  for (const Event& event : events_) {
    const bool is_unsent = event.kind == Event::Kind::kSent && is_failure(event.status);
    if (!is_unsent && event.kind != Event::Kind::kUntold) continue;
    const std::string text = (is_unsent ? kNotSent : "") + std::string(event.status.text());
    const auto same = [&](const auto& failure) { return failure.first == text; };
    const auto found = std::find_if(failures.begin(), failures.end(), same);
    if (found != failures.end()) {
      ++found->second;
    } else {
      failures.emplace_back(text, 1);
    }
  }
  for (const auto& [text, times] : failures) {
    print(times == 1 ? text : text + " (" + std::to_string(times) + " times)");
  }
}

void Deliveries::deliver(const std::shared_ptr<SubscriberState>& subscriber,
                         const ipc::DeliverFrame& frame, bool may_call) {
  if (!may_call || !events_.empty() || subscriber->reads_ahead()) {
    return wait_in_turn(subscriber, frame);
  }
  convert(frame, message_);
  hand_over(*subscriber, message_);
}

void Deliveries::tell_sent(const std::shared_ptr<PublisherState>& publisher, const Status& status,
                           bool may_call) {
  if (may_call && events_.empty()) {
    run_sent(*publisher, status);
  } else {
    post({Event::Kind::kSent, {}, publisher, status});
  }
}

/// One of those that were handed over before, with its memory, or a new one.
std::unique_ptr<Message> Deliveries::take_message() {
  if (spare_messages_.empty()) return std::make_unique<Message>();
  std::unique_ptr<Message> message = std::move(spare_messages_.back());
  spare_messages_.pop_back();
  return message;
}

void Deliveries::give_back(std::unique_ptr<Message> message) {
  const bool is_small = message->payload.capacity() <= kSparePayloadBytes;
  if (is_small && spare_messages_.size() < kMostSpare) {
    spare_messages_.push_back(std::move(message));
  }
}

/// Behind what happened before it; the subscriber's policy may drop others of its messages.
void Deliveries::wait_in_turn(const std::shared_ptr<SubscriberState>& subscriber,
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
void Deliveries::drop_waiting(SubscriberState& subscriber, std::size_t index) {
  const auto at = subscriber.waiting.begin() + static_cast<std::ptrdiff_t>(index);
  Loss lost = (*at)->lost_before;
  ++lost.client;
  give_back(std::move(*at));
  const auto next = subscriber.waiting.erase(at);
  (next != subscriber.waiting.end() ? (*next)->lost_before : subscriber.lost) += lost;
  note_loss(subscriber);
}

/// With its event: there is no room for more.
void Deliveries::drop_oldest_message() {
  const auto oldest = std::find_if(events_.begin(), events_.end(), [](const Event& event) {
    return event.kind == Event::Kind::kMessage;
  });
  if (oldest == events_.end()) return;
  if (oldest->subscriber->reads_ahead()) --read_ahead_;
  drop_waiting(*oldest->subscriber, 0);
  events_.erase(oldest);
}

void Deliveries::run_message(SubscriberState& subscriber) {
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

void Deliveries::hand_over(SubscriberState& subscriber, Message& message) {
  if (subscriber.lost) message.lost_before += std::exchange(subscriber.lost, {});
  if (message.buffering_delay && message.received_at) {
    *message.buffering_delay +=
        std::chrono::duration_cast<std::chrono::microseconds>(loop::now() - *message.received_at);
  }
  if (message.lost_before && callbacks_.on_gap) {
    const auto callback = callbacks_.on_gap;  // it may replace itself
    callback(message);
  }
  if (!subscriber.is_closed && subscriber.receive) subscriber.receive(message);
}

void Deliveries::note_loss(SubscriberState& subscriber) {
  ++subscriber.unreported_loss;
  has_unreported_loss_ = true;
}

void Deliveries::run_sent(const PublisherState& publisher, const Status& status) {
  if (publisher.is_closed) return;
  if (publisher.sent) {
    publisher.sent(status);
  } else if (is_failure(status)) {
    report(status);
  }
}

void Deliveries::post(Event event) {
  if (is_closed_) return;
  if (events_.size() >= kEventsMax && event.kind == Event::Kind::kMessage) drop_oldest_message();
  events_.push_back(std::move(event));
  wake_();
}

/// What other threads had to report.
void Deliveries::take_reports() {
  for (const Status& status : reports_.take()) report_untold(status);
}

void Deliveries::run() {
  if (reports_.has_any()) take_reports();
  while (!events_.empty()) {
    const Event event = std::move(events_.front());
    events_.pop_front();
    run_event(event);
    // What on_error itself did wrong waits for the next process(), or this one would never end.
    const bool is_error = event.kind == Event::Kind::kError || event.kind == Event::Kind::kUntold;
    if (!is_error && reports_.has_any()) take_reports();
  }
}

void Deliveries::run_event(const Event& event) {
  // A callback may replace itself: run a copy.
  switch (event.kind) {
    case Event::Kind::kMessage:
      run_message(*event.subscriber);
      break;
    case Event::Kind::kSent:
      run_sent(*event.publisher, event.status);
      break;
    case Event::Kind::kDisconnect:
      if (const auto callback = callbacks_.on_disconnect) callback(event.status);
      break;
    case Event::Kind::kReconnect:
      if (const auto callback = callbacks_.on_reconnect) callback();
      break;
    case Event::Kind::kError:
    case Event::Kind::kUntold:
      if (const auto callback = callbacks_.on_error) callback(event.status);
      break;
  }
}

void Deliveries::set_default_callbacks() {
  callbacks_.on_disconnect = [](const Status& status) { print(status.text()); };
  callbacks_.on_reconnect = [] { print("connected to swarmtalkd again"); };
  // At most one line a second for each cause. Shared: callbacks are copied before they run.
  callbacks_.on_error = [told = told_](const Status& status) {
    const Wakeup::Clock::time_point now = loop::now();
    const auto [found, is_first] = told->try_emplace(status.code());
    Told& cause = found->second;
    cause.text = status.text();
    ++cause.untold;
    if (is_first || now - cause.at >= std::chrono::seconds(1)) tell(cause, now);
  };
}

}  // namespace swarmtalk::client
