#include "client_lib/engine.hpp"

#include <utility>

#include "client_lib/program_end.hpp"
#include "client_lib/protobuf_log.hpp"
#include "client_lib/scope.hpp"
#include "client_lib/unread.hpp"
#include "loop/clock.hpp"

namespace swarmtalk::client {
namespace {

constexpr int kReadsAhead = 16;                 // of 64 KiB: more than the daemon's socket holds
constexpr std::size_t kEventsReadAhead = 1024;  // well below what would drop messages

/// When a callback throws out of process(), what was left undone must be seen by the next poll.
class WakeUnlessDone {
 public:
  explicit WakeUnlessDone(Wakeup& wakeup) : wakeup_(wakeup) {}
  ~WakeUnlessDone() {
    if (!is_done_) wakeup_.wake();
  }
  WakeUnlessDone(const WakeUnlessDone&) = delete;
  WakeUnlessDone& operator=(const WakeUnlessDone&) = delete;
  void done() { is_done_ = true; }

 private:
  Wakeup& wakeup_;
  bool is_done_ = false;
};

}  // namespace

Engine::Engine(std::string_view name, const ClientOptions& options)
    : request_timeout_(options.request_timeout),
      entrance_(reports_, [this] { wakeup_.wake(); }),
      hints_([this] { return refusals_.tells_stderr(); }),
      deliveries_(reports_,
                  [this] {
                    if (!is_processing_) wakeup_.wake();
                  }),
      requests_([this](const ipc::Envelope& envelope) {
        const std::lock_guard lock(gate_);
        return connection_.append(envelope);
      }),
      handles_(gate_, requests_, deliveries_,
               {[this] { keeper_.become_up(); }, [this] { write_requests(); }}),
      poses_(requests_, deliveries_,
             {[this] { write_requests(); }, [this] { keeper_.look(); }, print_hint}),
      sender_(gate_, connection_, reports_,
              {[this] { wakeup_.wake(); }, [this] { look_for_answers(); }}),
      silence_(requests_, wakeup_, [this](const std::string& text) { hints_.tell(text); }),
      inbox_(handles_, requests_, deliveries_, silence_),
      keeper_(std::string(name), options, gate_, wakeup_, connection_, keeper_hooks()),
      questions_(requests_, options.request_timeout,
                 {[this] { return keeper_.require(); },
                  [this](Wakeup::Clock::time_point deadline, const std::function<bool()>& enough) {
                    return keeper_.wait_until(deadline, enough);
                  }}),
      registration_(handles_, deliveries_, registration_hooks()) {
  filter_protobuf_log();
  wakeup_.wake();  // so that an app that only polls fd() calls process(), which connects
}

ConnectionKeeper::Hooks Engine::keeper_hooks() {
  return {.on_message = [this](const ipc::DeliverFrame& message,
                               bool may_call) { inbox_.take(message, may_call); },
          .on_envelope = [this](const ipc::Envelope& envelope,
                                bool may_call) { inbox_.take(envelope, may_call); },
          .on_greeted = [this] { handles_.register_all(); },
          .on_return = [this] { deliveries_.post_reconnect(); },
          .on_loss =
              [this](const Status& why) {
                is_loss_untold_ = true;
                deliveries_.post_disconnect(why);
              },
          .on_failure = [this](const Status& why) { deliveries_.report(why); },
          .on_down =
              [this] {
                const Status gone(StatusCode::kDisconnected);
                handles_.forget(gone);
                requests_.fail_all(gone);
                poses_.forget();
                silence_.forget();
              }};
}

Registration::Hooks Engine::registration_hooks() {
  return {.has_started = [this] { return keeper_.has_started(); },
          .connect = [this] { return keeper_.connect(); },
          .is_greeted = [this] { return keeper_.is_greeted(); },
          .wait = [this](const std::function<bool()>& enough) { return questions_.wait(enough); }};
}

Engine::~Engine() {
  close();
}

void Engine::close() {
  if (std::exchange(is_closed_, true)) return;
  // In a child all else, also the lock, may be in the middle of what the parent's threads did.
  if (!entrance_.is_own_process()) return connection_.close();
  entrance_.try_wait([this] { learn_the_rest(); });
  {
    const std::lock_guard lock(gate_);
    handles_.close();
  }
  keeper_.close();
  // Not behind the gate: what waits may hold a program's last callback, and with it a handle.
  requests_.clear();
  deliveries_.close(refusals_.tells_stderr());
  refusals_.tell_rest();
}

/// By exit() or a return from main: of a Client that somebody keeps, or that a callback or a
/// handler is in the middle of.
void Engine::end_with_program() {
  if (!entrance_.is_own_process() || entrance_.try_alone([this] { close(); })) return;
  const std::unique_lock lock(gate_, std::try_to_lock);
  if (!lock || connection_.flush_until(loop::now() + request_timeout_)) return;
  print_hint("this program ended before swarmtalkd had read its last messages; they are lost");
}

/// What the program sent last may have been refused, and a program that ends would not hear of it.
void Engine::learn_the_rest() {
  if (!sender_.has_sent() && !poses_.is_unanswered()) return;
  if (!keeper_.is_up() && !is_loss_untold_) return;
  report_losses();
  poses_.send_rest();
  std::optional<Pose> unused;
  const StatusCode code =
      keeper_.is_up() ? questions_.get_pose(unused).code() : StatusCode::kDisconnected;
  if (code != StatusCode::kTimeout && code != StatusCode::kDisconnected) return;
  const std::string what =
      code == StatusCode::kTimeout ? "swarmtalkd did not answer when" : "swarmtalkd was gone when";
  deliveries_.report_untold(
      Status(code, what + " this program ended: whether its last messages left is not known"));
}

/// What was lost or refused in this program, for the daemon's counters.
void Engine::report_losses() {
  const bool has_refused = sender_.take_has_refused();
  if ((deliveries_.take_has_loss() || has_refused) && keeper_.is_up()) handles_.report_losses();
}

/// What a write inside process() meets is dealt with at its end.
void Engine::write_requests() {
  if (!is_processing_) {
    keeper_.flush();
    return;
  }
  const std::lock_guard lock(gate_);
  static_cast<void>(connection_.flush());
}

Status Engine::process() {
  const auto self = shared_from_this();  // a callback may destroy the Client
  return entrance_.run([this] { return process_inside(); });
}

Status Engine::process_inside() {
  hints_.note_running();
  const Scope<bool> processing(is_processing_, true);
  WakeUnlessDone undone(wakeup_);
  wakeup_.take_wake();
  entrance_.note_caller();
  if (!keeper_.has_started()) keeper_.attempt_in_background();
  if (wakeup_.take_timer()) keeper_.on_timer();
  deliveries_.run();
  read_ahead();
  keeper_.flush();
  deliveries_.run();
  report_losses();
  if (keeper_.is_up() && handles_.has_subscribers()) silence_.watch();
  keeper_.flush();
  is_loss_untold_ = false;
  if (reports_.has_any()) wakeup_.wake();  // of on_error itself: next time
  undone.done();
  return keeper_.is_up() ? Status() : Status(StatusCode::kDisconnected);
}

/// What comes with them waits for process().
void Engine::look_for_answers() {
  entrance_.try_alone_as_owner([this] {
    if (keeper_.is_up()) keeper_.look();
  });
}

/// Reads; and while there are messages of which only the newest or the young count, all that waits.
void Engine::read_ahead() {
  for (int i = 0; i < kReadsAhead && keeper_.read({}); ++i) {
    if (!deliveries_.has_read_ahead() || deliveries_.size() >= kEventsReadAhead) break;
  }
}

Status Engine::run_until(Wakeup::Clock::time_point deadline) {
  const auto self = shared_from_this();
  return entrance_.run([&] {
    for (;;) {
      process_inside();
      if (is_stopped_.exchange(false) || is_closed_) return Status();
      do {
        if (loop::now() >= deadline) return Status();
      } while (!wakeup_.wait(deadline));
    }
  });
}

Status Engine::run_once(Wakeup::Clock::time_point deadline) {
  const auto self = shared_from_this();
  if (is_stopped_.exchange(false)) return Status();
  return entrance_.run([&] {
    wakeup_.wait(deadline);
    process_inside();
    is_stopped_.store(false);
    return Status();
  });
}

void Engine::stop() {
  if (!entrance_.is_own_process()) return;
  is_stopped_.store(true);
  wakeup_.wake();
}

Status Engine::connect() {
  return entrance_.wait([&] { return keeper_.connect(); });
}

Status Engine::get_status(DaemonStatus& status) {
  return entrance_.wait([&] { return questions_.get_status(status); });
}

Status Engine::get_neighbours(std::vector<Neighbour>& neighbours) {
  return entrance_.wait([&] {
    Status asked = questions_.get_neighbours(neighbours);
    if (asked && neighbours.empty()) hints_.note_nobody_around();
    return asked;
  });
}

Status Engine::get_pose(std::optional<Pose>& pose) {
  return entrance_.wait([&] { return questions_.get_pose(pose); });
}

Status Engine::sync() {
  return entrance_.wait([&] { return questions_.sync([this] { return !poses_.is_waiting(); }); });
}

Status Engine::set_pose(const OwnPose& pose) {
  return entrance_.wait([&] {
    if (Status connection = keeper_.require(); !connection) return connection;
    if (Status bad = poses_.set(pose); !bad) return bad;
    return keeper_.is_up() ? Status() : Status(StatusCode::kDisconnected);
  });
}

bool Engine::is_busy(const PublisherState& publisher) {
  const LockingCall locking;
  return entrance_.is_own_process() && sender_.is_busy(publisher);
}

std::optional<Status> Engine::refusal_of_child() {
  if (entrance_.is_own_process()) return std::nullopt;
  return entrance_.refuse_child();
}

Status Engine::publish(PublisherState& publisher, std::string_view payload,
                       std::optional<std::uint32_t> ttl) {
  if (!entrance_.is_own_process()) return entrance_.refuse_child();
  const LockingCall locking;
  Status status = sender_.publish(publisher, payload, ttl, entrance_.is_mine());
  if (status.code_ == StatusCode::kBusy) {
    const auto tell = [engine = weak_from_this()](const std::string& label, const std::string& why,
                                                  bool is_unread) {
      if (const auto alive = engine.lock()) alive->tell_unread(label, why, is_unread);
    };
    status.unread_ = std::make_shared<Unread>(tell, publisher.key->label, status.text_);
  }
  return status;
}

void Engine::tell_unread(const std::string& channel, const std::string& why, bool is_unread) {
  const LockingCall locking;
  const std::optional<Status> report = refusals_.note(channel, why, is_unread, loop::now());
  if (!report) return;
  reports_.add(*report);
  wakeup_.wake();
}

void Engine::remove(PublisherState& publisher) {
  if (!entrance_.is_own_process()) return;
  const LockingCall locking;
  handles_.remove(publisher);
}

void Engine::remove(SubscriberState& subscriber) {
  if (!entrance_.is_own_process()) return;
  const LockingCall locking;
  if (subscriber.id != 0 && keeper_.is_up()) hints_.note_end(subscriber.key->label);
  handles_.remove(subscriber);
}

std::shared_ptr<PublisherState> Engine::add_publisher(std::shared_ptr<const ChannelKey> key,
                                                      SentCallback sent, Sending sending) {
  auto publisher = std::make_shared<PublisherState>();
  publisher->key = std::move(key);
  hints_.note_name(*publisher->key);
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
  if (!subscriber->receive && subscriber->key->problem) {
    subscriber->status =
        Status(StatusCode::kBadArgument, "the function that " + subscriber->key->label +
                                             " was subscribed to with is empty: "
                                             "give one that takes each message");
    deliveries_.report_untold(subscriber->status);
    return subscriber;
  }
  hints_.note_name(*subscriber->key);
  // A program that looks on, or answers questions, expects nothing.
  if (!subscriber->policy.looks_on && subscriber->key->name != "harvest") {
    silence_.expect(subscriber);
  }
  return add(subscriber);
}

template <typename State>
std::shared_ptr<State> Engine::add(const std::shared_ptr<State>& handle) {
  handle->session = weak_from_this();
  const Status entered = entrance_.wait([&] {
    registration_.add(handle);
    return Status();
  });
  if (!entered) handle->status = entered;
  return handle;
}

}  // namespace swarmtalk::client
