#include "client_lib/engine.hpp"

#include <cstdio>
#include <exception>
#include <utility>

#include "client_lib/convert.hpp"
#include "client_lib/protobuf_log.hpp"
#include "client_lib/scope.hpp"
#include "client_lib/unread.hpp"

namespace swarmtalk::client {
namespace {

constexpr int kReadsAhead = 16;                 // of 64 KiB: more than the daemon's socket holds
constexpr std::size_t kEventsReadAhead = 1024;  // well below what would drop messages

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

Engine::Engine(std::string_view name, const ClientOptions& options)
    : deliveries_(reports_,
                  [this] {
                    if (!is_processing_) wakeup_.wake();
                  }),
      requests_([this](const ipc::Envelope& envelope) {
        const std::lock_guard lock(gate_);
        return connection_.append(envelope);
      }),
      handles_(gate_, requests_, deliveries_,
               {[this] { keeper_.become_up(); }, [this] { flush_unless_gathering(); }}),
      poses_(requests_, deliveries_, [this] { flush_unless_gathering(); }),
      sender_(gate_, connection_, reports_, [this] { wakeup_.wake(); }),
      keeper_(std::string(name), options, gate_, wakeup_, connection_, keeper_hooks()),
      questions_(requests_, options.request_timeout,
                 {[this] { return keeper_.require(); },
                  [this](Wakeup::Clock::time_point deadline, const std::function<bool()>& enough) {
                    return keeper_.wait_until(deadline, enough);
                  }}) {
  filter_protobuf_log();
  wakeup_.wake();  // so that an app that only polls fd() calls process(), which connects
}

ConnectionKeeper::Hooks Engine::keeper_hooks() {
  return {.on_message =
              [this](const ipc::DeliverFrame& message, bool may_call) {
                handles_.deliver(message, may_call);
                run_between(may_call);
              },
          .on_envelope =
              [this](const ipc::Envelope& envelope, bool may_call) {
                handle(envelope, may_call);
                run_between(may_call);
              },
          .on_greeted = [this] { handles_.register_all(); },
          .on_return = [this] { deliveries_.post_reconnect(); },
          .on_loss = [this](const Status& why) { deliveries_.post_disconnect(why); },
          .on_failure = [this](const Status& why) { deliveries_.report(why); },
          .on_down =
              [this] {
                const Status gone(StatusCode::kDisconnected);
                handles_.forget(gone);
                requests_.fail_all(gone);
                poses_.forget();
              }};
}

Engine::~Engine() {
  close();
}

void Engine::close() {
  if (std::exchange(is_closed_, true)) return;
  {
    const std::lock_guard lock(gate_);
    handles_.close();
  }
  keeper_.close();
  // Not behind the gate: what waits may hold a program's last callback, and with it a handle.
  requests_.clear();
  deliveries_.close();
  refusals_.tell_rest();
}

void Engine::handle(const ipc::Envelope& envelope, bool may_call) {
  if (envelope.has_deliver()) {
    handles_.deliver(ipc::frame_of(envelope.deliver()), may_call);
  } else if (envelope.has_sent()) {
    handles_.end_publication(envelope.sent().publisher_id(), envelope.sent().publish_number(),
                             Status(), may_call);
  } else if (envelope.request_id() != 0) {
    requests_.answer(envelope);
  } else if (envelope.has_failure()) {
    const ipc::Failure& failure = envelope.failure();
    if (failure.has_publisher_id()) {
      handles_.end_publication(failure.publisher_id(), failure.publish_number(), convert(failure),
                               may_call);
    } else {
      deliveries_.report(convert(failure));
    }
  }
  // Anything else is from a newer minor: not for us.
}

/// Before the next of what was read at once.
void Engine::run_between(bool may_call) {
  if (may_call && !deliveries_.has_read_ahead()) deliveries_.run();
}

void Engine::flush_unless_gathering() {
  if (!is_processing_) keeper_.flush();
}

/// Who may not come in. That is told in any case: the answer of run_for() is one that nobody reads.
Status Engine::refuse(const Turn::Stay& stay) {
  const Status status(StatusCode::kBadArgument,
                      stay.is_refused() ? "a Client was called while another thread is inside it, "
                                          "in process(), run() or a call that waits; one thread "
                                          "owns a Client, others may call send() and stop()"
                                        : "process() and run() cannot be called inside a callback; "
                                          "return from it instead");
  reports_.add(status);
  wakeup_.wake();
  return status;
}

Status Engine::process() {
  const auto self = shared_from_this();  // a callback may destroy the Client
  const Turn::Stay stay(turn_);
  return stay.is_first() ? process_inside() : refuse(stay);
}

Status Engine::process_inside() {
  has_processed_ = true;
  const Scope<bool> processing(is_processing_, true);
  WakeOnThrow wake_on_throw(wakeup_);
  wakeup_.take_wake();
  if (turn_.is_called_in_turn()) {
    reports_.add(Status(StatusCode::kBadArgument,
                        "process() or run() is called by two threads in turn, so callbacks run in "
                        "both; one thread owns a Client, others may call send() and stop()"));
  }
  if (!keeper_.has_started()) keeper_.attempt_in_background();
  if (wakeup_.take_timer()) keeper_.on_timer();
  deliveries_.run();
  read_ahead();
  keeper_.flush();
  deliveries_.run();
  if (deliveries_.take_has_loss() && keeper_.is_up()) handles_.report_losses();
  keeper_.flush();
  if (reports_.has_any()) wakeup_.wake();  // of on_error itself: next time
  return keeper_.is_up() ? Status() : Status(StatusCode::kDisconnected);
}

/// Reads; and while there are messages of which only the newest or the young count, all that waits.
void Engine::read_ahead() {
  for (int i = 0; i < kReadsAhead && keeper_.read({}); ++i) {
    if (!deliveries_.has_read_ahead() || deliveries_.size() >= kEventsReadAhead) break;
  }
}

Status Engine::run_until(Wakeup::Clock::time_point deadline) {
  const auto self = shared_from_this();
  const Turn::Stay stay(turn_);
  if (!stay.is_first()) return refuse(stay);
  for (;;) {
    process_inside();
    if (is_stopped_.exchange(false) || is_closed_) return Status();
    do {
      if (Wakeup::Clock::now() >= deadline) return Status();
    } while (!wakeup_.wait(deadline));
  }
}

Status Engine::run_once(Wakeup::Clock::time_point deadline) {
  const auto self = shared_from_this();
  if (is_stopped_.exchange(false)) return Status();
  const Turn::Stay stay(turn_);
  if (!stay.is_first()) return refuse(stay);
  wakeup_.wait(deadline);
  process_inside();
  is_stopped_.store(false);
  return Status();
}

void Engine::stop() {
  is_stopped_.store(true);
  wakeup_.wake();
}

/// A call that waits for the daemon: inside a callback as well, but in one thread at a time.
template <typename Call>
Status Engine::wait_inside(const Call& call) {
  const Turn::Stay stay(turn_);
  return stay.is_refused() ? refuse(stay) : call();
}

Status Engine::connect() {
  return wait_inside([&] { return keeper_.connect(); });
}

Status Engine::get_status(DaemonStatus& status) {
  return wait_inside([&] { return questions_.get_status(status); });
}

Status Engine::get_neighbours(std::vector<Neighbour>& neighbours) {
  return wait_inside([&] { return questions_.get_neighbours(neighbours); });
}

Status Engine::get_pose(std::optional<Pose>& pose) {
  return wait_inside([&] { return questions_.get_pose(pose); });
}

Status Engine::sync() {
  return wait_inside([&] { return questions_.sync([this] { return !poses_.is_waiting(); }); });
}

Status Engine::set_pose(const OwnPose& pose) {
  return wait_inside([&] {
    if (Status connection = keeper_.require(); !connection) return connection;
    if (Status bad = poses_.set(pose); !bad) return bad;
    return keeper_.is_up() ? Status() : Status(StatusCode::kDisconnected);
  });
}

Status Engine::publish(PublisherState& publisher, std::string_view payload,
                       std::optional<std::uint32_t> ttl) {
  Status status = sender_.publish(publisher, payload, ttl, turn_.is_mine());
  if (status.code_ == StatusCode::kBusy) {
    const auto tell = [engine = weak_from_this()](const std::string& label,
                                                  const std::string& why) {
      if (const auto alive = engine.lock()) alive->tell_unread(label, why);
    };
    status.unread_ = std::make_shared<Unread>(tell, publisher.key->label, status.text_);
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
  if (!has_processed_ && subscriber.id != 0 && keeper_.is_up() && refusals_.tells_stderr()) {
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
  publisher->key = std::move(key);
  publisher->sent = std::move(sent);
  publisher->sending = sending;
  return add(publisher);
}

std::shared_ptr<SubscriberState> Engine::add_subscriber(std::shared_ptr<const ChannelKey> key,
                                                        ReceiveCallback receive, Policy policy) {
  auto subscriber = std::make_shared<SubscriberState>();
  subscriber->key = std::move(key);
  subscriber->receive = std::move(receive);
  subscriber->policy = policy;
  return add(subscriber);
}

/// What no daemon could take is refused here: one frame that is not the protocol would cost the
/// client its connection, again and again.
template <typename State>
std::shared_ptr<State> Engine::add(const std::shared_ptr<State>& handle) {
  handle->session = weak_from_this();
  const Turn::Stay stay(turn_);
  if (stay.is_refused()) {
    handle->status = refuse(stay);
  } else if (!handle->key->problem) {
    handle->status = handle->key->problem;
    deliveries_.report(handle->status);
  } else {
    handles_.add(handle);
    register_new(*handle, [&] { handles_.register_one(handle); });
  }
  return handle;
}

void Engine::register_new(HandleState& handle, const std::function<void()>& register_now) {
  if (!keeper_.has_started()) {
    if (const Status status = keeper_.connect(); !status)
      deliveries_.report(status);  // registers it as well
    return;
  }
  if (!keeper_.is_greeted()) return;
  register_now();
  if (!questions_.wait([&] { return handle.is_answered; })) {
    handle.status = Status(StatusCode::kTimeout);
    deliveries_.report(handle.status);
  }
}

}  // namespace swarmtalk::client
