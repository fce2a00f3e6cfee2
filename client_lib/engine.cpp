// The connection's life: attempts with back-off, greeting, loss; and the event loop.
#include "client_lib/engine.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "client_lib/protobuf_log.hpp"
#include "client_lib/utf8.hpp"

namespace swarmtalk::client {

using std::chrono::milliseconds;

namespace {

constexpr std::size_t kNameMaxBytes = 1024;
constexpr int kReadsAhead = 16;                 // of 64 KiB: more than the daemon's socket holds
constexpr std::size_t kEventsReadAhead = 1024;  // well below what would drop messages

Status check_name(const std::string& name) {
  if (!is_utf8(name)) {
    return Status(StatusCode::kBadArgument, "the name of this Client is not UTF-8 text");
  }
  if (name.size() > kNameMaxBytes) {
    return Status(StatusCode::kBadArgument, "the name of this Client has more than " +
                                                std::to_string(kNameMaxBytes) + " bytes");
  }
  return Status();
}

/// Holds a value for a scope, also when a callback throws through it.
template <typename T>
class Scope {
 public:
  Scope(T& variable, T value) : variable_(variable), old_(std::exchange(variable, value)) {}
  ~Scope() { variable_ = old_; }
  Scope(const Scope&) = delete;
  Scope& operator=(const Scope&) = delete;

 private:
  T& variable_;
  T old_;
};

/// Tells for a scope which thread is inside.
class ThreadMark {
 public:
  explicit ThreadMark(std::atomic<std::thread::id>& mark) : mark_(mark) {
    mark_.store(std::this_thread::get_id());
  }
  ~ThreadMark() { mark_.store(std::thread::id()); }
  ThreadMark(const ThreadMark&) = delete;
  ThreadMark& operator=(const ThreadMark&) = delete;

 private:
  std::atomic<std::thread::id>& mark_;
};

/// When a callback throws out of process(), what was left undone must be seen by the next poll.
class WakeOnThrow {
 public:
  explicit WakeOnThrow(Wakeup& wakeup) : wakeup_(wakeup), exceptions_(std::uncaught_exceptions()) {}
  ~WakeOnThrow() {
    if (std::uncaught_exceptions() > exceptions_) wakeup_.wake();
  }
  WakeOnThrow(const WakeOnThrow&) = delete;
  WakeOnThrow& operator=(const WakeOnThrow&) = delete;

 private:
  Wakeup& wakeup_;
  int exceptions_;
};

}  // namespace

Engine::Engine(std::string_view name, ClientOptions options)
    : name_(name),
      options_(std::move(options)),
      path_(socket_path(options_.socket_path)),
      deliveries_(reports_,
                  [this] {
                    if (!is_processing_) wakeup_.wake();
                  }),
      requests_([this](const ipc::Envelope& envelope) {
        const std::lock_guard lock(gate_);
        return connection_.append(envelope);
      }),
      handles_(gate_, requests_, deliveries_,
               {[this] { become_up(); }, [this] { flush_unless_gathering(); }}),
      sender_(gate_, connection_, reports_, [this] { wakeup_.wake(); }),
      backoff_(options_.reconnect_first),
      jitter_(std::random_device{}()) {
  filter_protobuf_log();
  wakeup_.wake();  // so that an app that only polls fd() calls process(), which connects
}

Engine::~Engine() {
  close();
}

void Engine::close() {
  if (std::exchange(is_closed_, true)) return;
  wakeup_.unwatch();
  wakeup_.clear_timer();
  {
    const std::lock_guard lock(gate_);
    connection_.close();
    phase_ = Phase::kDown;
    handles_.close();
  }
  // Not behind the gate: what waits may hold a program's last callback, and with it a handle.
  requests_.clear();
  deliveries_.close();
  refusals_.tell_rest();
}

/// One try to open the socket. Success means: greeting sent, answer awaited.
Status Engine::attempt() {
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
  wakeup_.set_timer(Wakeup::Clock::now() + options_.connect_timeout);
  ipc::Hello& hello = *requests_.make().mutable_hello();
  hello.set_major(ipc::kProtocolMajor);
  hello.set_minor(ipc::kProtocolMinor);
  hello.set_name(name_);
  if (wants_ring_) hello.add_features(ipc::kRingFeature);
  requests_.send_unnumbered();
  return flush();
}

void Engine::attempt_in_background() {
  if (const Status status = attempt(); !status && phase_ == Phase::kDown) report_attempt(status);
}

void Engine::schedule_attempt() {
  // Half to all of the back-off: many clients of one daemon must not return in step.
  std::uniform_int_distribution<std::int64_t> spread(backoff_.count() * 500,
                                                     backoff_.count() * 1000);
  wakeup_.set_timer(Wakeup::Clock::now() + std::chrono::microseconds(spread(jitter_)));
  backoff_ = std::min(options_.reconnect_max, backoff_ * 2);
}

void Engine::on_timer() {
  if (phase_ == Phase::kDown) {
    attempt_in_background();
  } else if (phase_ != Phase::kUp) {
    drop(no_answer());
  }
}

/// Ends the present connection; the next attempt is scheduled, all that waited is answered.
void Engine::drop(const Status& why) {
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
    deliveries_.post_disconnect(why);
  } else {
    report_attempt(why);
  }
  const Status gone(StatusCode::kDisconnected);
  handles_.forget(gone);
  requests_.fail_all(gone);
  is_pose_in_flight_ = false;
  next_pose_.reset();
  if (why.code() == StatusCode::kVersionMismatch) backoff_ = options_.reconnect_max;
  schedule_attempt();
}

void Engine::become_up() {
  phase_ = Phase::kUp;
  was_up_ = true;
  wakeup_.clear_timer();
  backoff_ = options_.reconnect_first;
  last_failure_ = Status();
  reported_failure_.reset();
  if (std::exchange(is_reconnect_, false)) deliveries_.post_reconnect();
}

Status Engine::connect() {
  if (phase_ == Phase::kUp) return Status();
  const auto deadline = Wakeup::Clock::now() + options_.connect_timeout;
  const Scope<bool> quiet(is_connecting_, true);  // the caller gets the failure, on_error does not
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

Status Engine::no_answer() const {
  return Status(StatusCode::kTimeout, "swarmtalkd at " + path_ + " did not answer within " +
                                          std::to_string(options_.connect_timeout.count()) +
                                          " ms; it is stopped or overloaded");
}

Status Engine::flush() {
  if (phase_ == Phase::kDown || is_ending_) return Status();
  Status status;
  bool waits_for_socket = false;
  {
    const std::lock_guard lock(gate_);
    status = connection_.flush();
    waits_for_socket = connection_.waits_for_socket();
  }
  if (status) {
    wakeup_.watch(connection_.fd(), waits_for_socket);
    return status;
  }
  read_last_words(status);
  return last_failure_;
}

/// Nothing can be written any more, but why may wait to be read, such as a refusal. Runs no
/// callback: what comes is kept for process(). Ends in drop().
void Engine::read_last_words(const Status& why) {
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

/// Reads once and handles what has come, until `enough`; more stays for the next call.
/// @return whether the socket may have more
bool Engine::read_envelopes(const std::function<bool()>& enough) {
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
    if (waits_ == 0 && !deliveries_.has_read_ahead()) deliveries_.run();
  }
  if (!received) drop(received);
  return received.ok() && connection_.may_have_more();
}

/// Reads; and while there are messages of which only the newest or the young count, all that waits.
void Engine::read_ahead() {
  for (int i = 0; i < kReadsAhead && read_envelopes({}); ++i) {
    if (!deliveries_.has_read_ahead() || deliveries_.size() >= kEventsReadAhead) break;
  }
}

/// Waits without running callbacks. @return enough()
bool Engine::wait_until(Deadline deadline, const std::function<bool()>& enough) {
  const Scope<int> waiting(waits_, waits_ + 1);
  for (;;) {
    flush();
    read_envelopes(enough);
    flush();
    const bool is_enough = enough();
    if (is_enough || Wakeup::Clock::now() >= deadline) {
      wakeup_.wake();  // envelopes may be left in the buffer, where no poll sees them
      return is_enough;
    }
    wakeup_.wait_for_socket(deadline);
    if (wakeup_.take_timer()) on_timer();
  }
}

/// Whether process() may begin. Who is refused is told in any case: the answer of run_for() is one
/// that nobody reads.
Status Engine::check_outside() {
  const std::thread::id inside = processing_thread_.load();
  if (inside == std::thread::id()) return Status();
  const bool is_callback = inside == std::this_thread::get_id();
  const Status status(StatusCode::kBadArgument,
                      is_callback ? "process() and run() cannot be called inside a callback; "
                                    "return from it instead"
                                  : "process() and run() were called while another thread is "
                                    "inside them; one thread owns a Client");
  reports_.add(status);
  wakeup_.wake();
  return status;
}

Status Engine::process() {
  if (Status status = check_outside(); !status) return status;
  const auto self = shared_from_this();  // a callback may destroy the Client
  has_processed_ = true;
  const Scope<bool> processing(is_processing_, true);
  const ThreadMark mark(processing_thread_);
  WakeOnThrow wake_on_throw(wakeup_);
  wakeup_.take_wake();
  if (!has_started_) attempt_in_background();
  if (wakeup_.take_timer()) on_timer();
  deliveries_.run();
  read_ahead();
  flush();
  deliveries_.run();
  if (deliveries_.take_has_loss() && phase_ == Phase::kUp) handles_.report_losses();
  flush();
  if (reports_.has_any()) wakeup_.wake();  // of on_error itself: next time
  return phase_ == Phase::kUp ? Status() : Status(StatusCode::kDisconnected);
}

Status Engine::run_until(Deadline deadline) {
  const auto self = shared_from_this();
  for (;;) {
    const Status status = process();
    if (status.code() == StatusCode::kBadArgument) return status;
    if (is_stopped_.exchange(false) || is_closed_) return Status();
    do {
      if (Wakeup::Clock::now() >= deadline) return Status();
    } while (!wakeup_.wait(deadline));
  }
}

Status Engine::run_once(Deadline deadline) {
  if (is_stopped_.exchange(false)) return Status();
  if (!is_processing_) wakeup_.wait(deadline);
  const Status status = process();
  is_stopped_.store(false);
  return status.code() == StatusCode::kBadArgument ? status : Status();
}

void Engine::stop() {
  is_stopped_.store(true);
  wakeup_.wake();
}

}  // namespace swarmtalk::client
