// What comes in from the daemon, and the user's callbacks.
#include <cstdio>
#include <utility>

#include "client_lib/convert.hpp"
#include "client_lib/session.hpp"

namespace swarmtalk::client {
namespace {

constexpr std::size_t kEventsMax = 4096;  // kept while a call waits; then the oldest message goes

std::string version_text(std::uint32_t major, std::uint32_t minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

/// Nearly all that comes is messages. @return false: malformed
bool Session::parse(std::string_view envelope) {
  ipc::DeliverFrame deliver;
  if (phase_ != Phase::kGreeting && ipc::parse(envelope, deliver)) {
    handle_deliver(deliver);
    return true;
  }
  if (!ipc::parse(envelope, incoming_)) return false;
  handle(incoming_);
  return true;
}

void Session::handle(const ipc::Envelope& envelope) {
  if (phase_ == Phase::kGreeting) {
    handle_greeting(envelope);
  } else if (envelope.has_deliver()) {
    handle_deliver(ipc::frame_of(envelope.deliver()));
  } else if (envelope.has_sent()) {
    handle_publish_end(envelope.sent().publisher_id(), envelope.sent().publish_number(), Status());
  } else if (envelope.request_id() != 0) {
    handle_reply(envelope);
  } else if (envelope.has_failure()) {
    const ipc::Failure& failure = envelope.failure();
    if (failure.has_publisher_id()) {
      handle_publish_end(failure.publisher_id(), failure.publish_number(), convert(failure));
    } else {
      report(convert(failure));
    }
  }
  // Anything else is from a newer minor: not for us.
}

void Session::handle_greeting(const ipc::Envelope& envelope) {
  if (envelope.has_failure()) return drop(convert(envelope.failure()));
  if (!envelope.has_hello()) return drop(Status(StatusCode::kProtocol));
  const ipc::Hello& hello = envelope.hello();
  if (hello.major() != ipc::kProtocolMajor) {
    return drop(Status(StatusCode::kVersionMismatch,
                       hello.name() + " at " + path_ + " speaks local protocol " +
                           version_text(hello.major(), hello.minor()) + ", this program " +
                           version_text(ipc::kProtocolMajor, ipc::kProtocolMinor) +
                           "; update the older of the two"));
  }
  if (!take_ring(hello)) return;
  node_id_ = hello.node_id();
  daemon_name_ = hello.name();
  register_all();
}

/// @return false: the daemon reads from a ring that we cannot write to; the connection is dropped,
///   and the next, without a ring, begins at once
bool Session::take_ring(const ipc::Hello& hello) {
  if (!ipc::has_feature(hello, ipc::kRingFeature)) return true;
  Status status;
  {
    const std::lock_guard lock(gate_);
    status = connection_.use_ring();
  }
  if (status) return true;
  wants_ring_ = false;
  drop(status);
  last_failure_ = Status();  // a connect() that waits goes on waiting: the next attempt is now
  wakeup_.set_timer(Wakeup::Clock::now());
  return false;
}

void Session::handle_reply(const ipc::Envelope& envelope) {
  const auto found = pending_.find(envelope.request_id());
  if (found == pending_.end()) return;  // its caller gave up waiting
  const Completion done = std::move(found->second);
  pending_.erase(found);
  if (envelope.has_failure()) {
    done(nullptr, convert(envelope.failure()));
  } else {
    done(&envelope, Status());
  }
}

void Session::handle_deliver(const ipc::DeliverFrame& deliver) {
  const auto found = subscribers_by_id_.find(deliver.subscription_id);
  if (found == subscribers_by_id_.end()) return;  // on its way when we unsubscribed
  if (waits_ != 0 || !events_.empty() || found->second->reads_ahead()) {
    return wait_in_turn(found->second, deliver);
  }
  const std::shared_ptr<SubscriberState> subscriber = found->second;  // the callback may remove it
  convert(deliver, message_);
  hand_over(*subscriber, message_);
}

void Session::handle_publish_end(std::uint32_t publisher_id, std::uint64_t number,
                                 const Status& status) {
  const auto found = publishers_by_id_.find(publisher_id);
  if (found == publishers_by_id_.end()) return;
  PublisherState& publisher = *found->second;
  {
    const std::lock_guard lock(gate_);
    auto& in_flight = publisher.in_flight;
    if (status && publisher.sent_every > 1) {
      while (!in_flight.empty() && in_flight.front() <= number) in_flight.pop_front();
      return;  // it has no callback
    }
    if (std::erase(in_flight, number) == 0) return;
  }
  const std::shared_ptr<PublisherState> keep_alive = found->second;
  if (waits_ == 0 && events_.empty()) {
    tell_sent(publisher, status);
  } else {
    post({Event::Kind::kSent, {}, keep_alive, status});
  }
}

void Session::tell_sent(const PublisherState& publisher, const Status& status) {
  if (publisher.is_closed) return;
  if (publisher.sent) {
    publisher.sent(status);
  } else if (!status && status.code() != StatusCode::kDisconnected &&
             status.code() != StatusCode::kDropped) {
    report(status);
  }
}

/// A failure to connect: told once, not at each attempt, and not after "lost swarmtalkd" when all
/// it says is that the daemon is still away.
void Session::report_attempt(const Status& status) {
  if (is_connecting_ || reported_failure_ == status.code()) return;
  reported_failure_ = status.code();
  const StatusCode code = status.code();
  const bool is_away = code == StatusCode::kNoDaemon || code == StatusCode::kDaemonDead ||
                       code == StatusCode::kDisconnected;
  if (!(is_reconnect_ && is_away)) report(status);
}

void Session::post(Event event) {
  if (is_closed_) return;
  if (events_.size() >= kEventsMax && event.kind == Event::Kind::kMessage) drop_oldest_message();
  events_.push_back(std::move(event));
  if (!is_processing_) wakeup_.ring();
}

/// What other threads had to report.
void Session::take_reports() {
  std::vector<Status> reports;
  {
    const std::lock_guard lock(gate_);
    reports.swap(reports_);
    has_reports_.store(false);
  }
  for (const Status& status : reports) report(status);
}

void Session::run_events() {
  if (has_reports_.load()) take_reports();
  while (!events_.empty()) {
    const Event event = std::move(events_.front());
    events_.pop_front();
    run_event(event);
    if (has_reports_.load()) take_reports();
  }
}

void Session::run_event(const Event& event) {
  // A callback may replace itself: run a copy.
  switch (event.kind) {
    case Event::Kind::kMessage:
      run_message(*event.subscriber);
      break;
    case Event::Kind::kSent:
      tell_sent(*event.publisher, event.status);
      break;
    case Event::Kind::kDisconnect:
      if (const auto callback = on_disconnect) callback(event.status);
      break;
    case Event::Kind::kReconnect:
      if (const auto callback = on_reconnect) callback();
      break;
    case Event::Kind::kError:
      if (const auto callback = on_error) callback(event.status);
      break;
  }
}

void Session::set_default_callbacks() {
  const auto print = [](std::string_view text) {
    std::fprintf(stderr, "swarmtalk: %.*s\n", static_cast<int>(text.size()), text.data());
  };
  on_disconnect = [print](const Status& status) { print(status.text()); };
  on_reconnect = [print] { print("connected to swarmtalkd again"); };
  // At most one line a second for each cause.
  std::unordered_map<StatusCode, Deadline> last;
  on_error = [print, last](const Status& status) mutable {
    const Deadline now = Wakeup::Clock::now();
    const auto found = last.find(status.code());
    if (found != last.end() && now - found->second < std::chrono::seconds(1)) return;
    last[status.code()] = now;
    print(status.text());
  };
}

}  // namespace swarmtalk::client
