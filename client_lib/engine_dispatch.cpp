// What comes in from the daemon.
#include <utility>

#include "client_lib/convert.hpp"
#include "client_lib/engine.hpp"

namespace swarmtalk::client {
namespace {

std::string version_text(std::uint32_t major, std::uint32_t minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

/// Nearly all that comes is messages. @return false: malformed
bool Engine::parse(std::string_view envelope) {
  ipc::DeliverFrame deliver;
  if (phase_ != Phase::kGreeting && ipc::parse(envelope, deliver)) {
    handles_.deliver(deliver, waits_ == 0);
    return true;
  }
  if (!ipc::parse(envelope, incoming_)) return false;
  handle(incoming_);
  return true;
}

void Engine::handle(const ipc::Envelope& envelope) {
  if (phase_ == Phase::kGreeting) {
    handle_greeting(envelope);
  } else if (envelope.has_deliver()) {
    handles_.deliver(ipc::frame_of(envelope.deliver()), waits_ == 0);
  } else if (envelope.has_sent()) {
    handles_.end_publication(envelope.sent().publisher_id(), envelope.sent().publish_number(),
                             Status(), waits_ == 0);
  } else if (envelope.request_id() != 0) {
    requests_.answer(envelope);
  } else if (envelope.has_failure()) {
    const ipc::Failure& failure = envelope.failure();
    if (failure.has_publisher_id()) {
      handles_.end_publication(failure.publisher_id(), failure.publish_number(), convert(failure),
                               waits_ == 0);
    } else {
      deliveries_.report(convert(failure));
    }
  }
  // Anything else is from a newer minor: not for us.
}

void Engine::handle_greeting(const ipc::Envelope& envelope) {
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
  phase_ = Phase::kRegistering;
  handles_.register_all();
}

/// @return false: the daemon reads from a ring that we cannot write to; the connection is dropped,
///   and the next, without a ring, begins at once
bool Engine::take_ring(const ipc::Hello& hello) {
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

/// A failure to connect: told once, not at each attempt, and not after "lost swarmtalkd" when all
/// it says is that the daemon is still away.
void Engine::report_attempt(const Status& status) {
  if (is_connecting_ || reported_failure_ == status.code()) return;
  reported_failure_ = status.code();
  const StatusCode code = status.code();
  const bool is_away = code == StatusCode::kNoDaemon || code == StatusCode::kDaemonDead ||
                       code == StatusCode::kDisconnected;
  if (!(is_reconnect_ && is_away)) deliveries_.report(status);
}

}  // namespace swarmtalk::client
