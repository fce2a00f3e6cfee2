#include "client_lib/connection_keeper.hpp"

#include <utility>

#include "client_lib/greeting.hpp"
#include "client_lib/scope.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {

ConnectionKeeper::ConnectionKeeper(std::string name, const ClientOptions& options, std::mutex& gate,
                                   Wakeup& wakeup, Connection& connection, Hooks hooks)
    : name_(std::move(name)),
      path_(socket_path(options.socket_path)),
      timeout_(options.connect_timeout),
      gate_(gate),
      wakeup_(wakeup),
      connection_(connection),
      hooks_(std::move(hooks)),
      backoff_(options.reconnect_first, options.reconnect_max) {}

void ConnectionKeeper::close() {
  wakeup_.unwatch();
  wakeup_.clear_timer();
  const std::lock_guard lock(gate_);
  connection_.close();
  phase_ = Phase::kDown;
}

/// One try to open the socket. Success means: greeting sent, answer awaited.
Status ConnectionKeeper::attempt() {
  has_started_ = true;
  wakeup_.clear_timer();
  last_failure_ = check_name(name_);
  if (last_failure_) {
    const std::lock_guard lock(gate_);
    last_failure_ = connection_.open(path_);
  }
  if (!last_failure_) {
    schedule_attempt();
    return last_failure_;
  }
  phase_ = Phase::kGreeting;
  wakeup_.set_timer(loop::now() + timeout_);
  ipc::Envelope greeting;
  fill_hello(*greeting.mutable_hello(), name_);
  {
    const std::lock_guard lock(gate_);
    connection_.append(greeting);
  }
  return flush();
}

void ConnectionKeeper::attempt_in_background() {
  if (const Status status = attempt(); !status && phase_ == Phase::kDown) report_attempt(status);
}

void ConnectionKeeper::schedule_attempt() {
  wakeup_.set_timer(loop::now() + backoff_.next());
}

void ConnectionKeeper::on_timer() {
  if (phase_ == Phase::kDown) {
    attempt_in_background();
  } else if (phase_ != Phase::kUp) {
    drop(no_answer());
  }
}

/// Ends the present connection; the next attempt is scheduled, all that waited is answered.
void ConnectionKeeper::drop(const Status& why) {
  if (phase_ == Phase::kDown) return;
  phase_ = Phase::kDown;
  wakeup_.unwatch();
  {
    const std::lock_guard lock(gate_);
    connection_.close();
  }
  last_failure_ = why;
  if (std::exchange(was_up_, false)) {
    is_reconnect_ = true;
    hooks_.on_loss(why);
  } else {
    report_attempt(why);
  }
  hooks_.on_down();
  if (why.code() == StatusCode::kVersionMismatch) backoff_.be_longest();
  schedule_attempt();
}

void ConnectionKeeper::become_up() {
  phase_ = Phase::kUp;
  was_up_ = true;
  wakeup_.clear_timer();
  backoff_.reset();
  last_failure_ = Status();
  reported_failure_.reset();
  if (std::exchange(is_reconnect_, false)) hooks_.on_return();
}

Status ConnectionKeeper::connect() {
  if (phase_ == Phase::kUp) return Status();
  const auto deadline = loop::now() + timeout_;
  const Scope<bool> quiet(is_connecting_,
                          true);  // the caller gets the failure, on_failure does not
  if (phase_ == Phase::kDown) static_cast<void>(attempt());
  wait_until(deadline, [this] {
    const bool has_failed = !last_failure_ && last_failure_.code() != StatusCode::kTimeout;
    return phase_ == Phase::kUp || (phase_ == Phase::kDown && has_failed);
  });
  if (phase_ == Phase::kUp) return Status();
  const Status failure = last_failure_ ? no_answer() : last_failure_;
  reported_failure_ = failure.code();
  return failure;
}

Status ConnectionKeeper::require() {
  if (!has_started_) return connect();
  if (phase_ == Phase::kUp) return Status();
  return last_failure_ ? Status(StatusCode::kDisconnected) : last_failure_;
}

Status ConnectionKeeper::no_answer() const {
  return Status(StatusCode::kTimeout, "swarmtalkd at " + path_ + " did not answer within " +
                                          std::to_string(timeout_.count()) +
                                          " ms; it is stopped or overloaded");
}

Status ConnectionKeeper::flush() {
  if (phase_ == Phase::kDown || is_ending_) return Status();
  Status status;
  bool waits_for_socket = false;
  {
    const std::lock_guard lock(gate_);
    if (!connection_.is_idle()) {
      status = connection_.flush();
      waits_for_socket = connection_.has_outgoing();
    }
  }
  if (status) {
    wakeup_.watch(connection_.fd(), waits_for_socket);
    return status;
  }
  read_last_words(status);
  return last_failure_;
}

/// Nothing can be written any more, but why may wait to be read, such as a refusal. Runs no
/// callback: what comes is kept for later. Ends in drop().
void ConnectionKeeper::read_last_words(const Status& why) {
  const Scope<int> waiting(waits_, waits_ + 1);
  const Scope<bool> ending(is_ending_, true);
  ipc::Envelope envelope;  // `incoming_` may be in use by our caller
  while (phase_ != Phase::kDown) {
    const Status received = connection_.receive();
    bool is_any = false;
    while (phase_ != Phase::kDown) {
      const ipc::ReadResult result = connection_.next(envelope);
      if (result != ipc::ReadResult::kEnvelope) break;
      is_any = true;
      handle(envelope);
    }
    if (!received || !is_any) drop(why);
  }
}

bool ConnectionKeeper::read(const std::function<bool()>& enough) {
  if (phase_ == Phase::kDown) return false;
  const Status received = connection_.receive();
  while (phase_ != Phase::kDown) {
    if (enough && enough()) return false;
    std::string_view envelope;
    const ipc::ReadResult result = connection_.next(envelope);
    if (result == ipc::ReadResult::kNeedMore) break;
    if (result == ipc::ReadResult::kMalformed || !parse(envelope)) {
      drop(Status(StatusCode::kProtocol));
    }
  }
  if (!received) drop(received);
  return received.ok() && connection_.may_have_more();
}

void ConnectionKeeper::look() {
  const Scope<int> waiting(waits_, waits_ + 1);
  read({});
}

bool ConnectionKeeper::wait_until(Deadline deadline, const std::function<bool()>& enough) {
  const Scope<int> waiting(waits_, waits_ + 1);
  for (;;) {
    flush();
    read(enough);
    flush();
    const bool is_enough = enough();
    if (is_enough || loop::now() >= deadline) {
      wakeup_.wake();  // envelopes may be left in the buffer, where no poll sees them
      return is_enough;
    }
    wakeup_.wait_for_socket(deadline);
    if (wakeup_.take_timer()) on_timer();
  }
}

/// Nearly all that comes is messages. @return false: malformed
bool ConnectionKeeper::parse(std::string_view envelope) {
  ipc::DeliverFrame message;
  if (phase_ != Phase::kGreeting && ipc::parse(envelope, message)) {
    hooks_.on_message(message, waits_ == 0);
    return true;
  }
  if (!ipc::parse(envelope, incoming_)) return false;
  handle(incoming_);
  return true;
}

void ConnectionKeeper::handle(const ipc::Envelope& envelope) {
  if (phase_ == Phase::kGreeting) {
    handle_greeting(envelope);
  } else {
    hooks_.on_envelope(envelope, waits_ == 0);
  }
}

void ConnectionKeeper::handle_greeting(const ipc::Envelope& envelope) {
  if (const Status status = check_greeting(envelope, path_); !status) return drop(status);
  const ipc::Hello& hello = envelope.hello();
  node_id_ = hello.node_id();
  daemon_name_ = hello.name();
  phase_ = Phase::kRegistering;
  hooks_.on_greeted();
}

/// A failure to connect: told once, not at each attempt, and not after "lost swarmtalkd" when all
/// it says is that the daemon is still away.
void ConnectionKeeper::report_attempt(const Status& status) {
  if (is_connecting_ || reported_failure_ == status.code()) return;
  reported_failure_ = status.code();
  const StatusCode code = status.code();
  const bool is_away = code == StatusCode::kNoDaemon || code == StatusCode::kDaemonDead ||
                       code == StatusCode::kDisconnected;
  if (!(is_reconnect_ && is_away)) hooks_.on_failure(status);
}

}  // namespace swarmtalk::client
