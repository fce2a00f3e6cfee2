// The state machine behind a Client: connects, greets, registers, dispatches, reconnects. Single
// thread, the Client's owner. User callbacks run only inside process(); what a waiting call
// (connect, a registration, get_status) meets on the way is kept in `events_` until then.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <vector>

#include <swarmtalk/client.hpp>

#include "client_lib/connection.hpp"
#include "client_lib/state.hpp"
#include "client_lib/wakeup.hpp"
#include "ipc/framing.hpp"

namespace swarmtalk::client {

class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(std::string_view name, ClientOptions options);
  ~Session();

  // The functions of Client; contracts in client.hpp.
  Status connect();
  bool is_connected() const { return phase_ == Phase::kUp; }
  Status set_pose(const OwnPose& pose);
  Status get_status(DaemonStatus& status);
  Status get_neighbours(std::vector<Neighbour>& neighbours);
  Status get_pose(std::optional<Pose>& pose);
  Status sync();
  std::uint32_t node_id() const { return node_id_; }
  const std::string& daemon_name() const { return daemon_name_; }
  int fd() const { return wakeup_.fd(); }
  Status process();
  Status run_until(Wakeup::Clock::time_point deadline);
  Status run_once(Wakeup::Clock::time_point deadline);
  void stop();
  std::function<void(const Status&)> on_disconnect;
  std::function<void()> on_reconnect;
  std::function<void(const Message&)> on_gap;
  std::function<void(const Status&)> on_error;
  std::optional<Publisher> log_publisher;  // of Client::log(); none: not called yet

  // The functions of Channel, Publisher and Subscriber.
  std::shared_ptr<PublisherState> add_publisher(std::shared_ptr<const ChannelKey> key,
                                                SentCallback sent, Sending sending);
  std::shared_ptr<SubscriberState> add_subscriber(std::shared_ptr<const ChannelKey> key,
                                                  ReceiveCallback receive, Policy policy);
  /// Any thread.
  Status publish(PublisherState& publisher, std::string_view payload,
                 std::optional<std::uint32_t> ttl);
  bool is_busy(const PublisherState& publisher);
  std::mutex& gate() { return gate_; }
  void remove(PublisherState& publisher);
  void remove(SubscriberState& subscriber);

  /// The Client is gone: no callback after this, handles answer kDisconnected.
  void close();

 private:
  enum class Phase { kDown, kGreeting, kRegistering, kUp };
  using Deadline = Wakeup::Clock::time_point;
  /// `reply` is null when the request was refused; `status` then says why.
  using Completion = std::function<void(const ipc::Envelope* reply, const Status& status)>;

  struct Event {
    enum class Kind { kMessage, kSent, kDisconnect, kReconnect, kError };
    Kind kind;
    std::shared_ptr<SubscriberState> subscriber;
    std::shared_ptr<PublisherState> publisher;
    Status status;
  };

  // session.cpp: the connection's life
  Status attempt();
  void attempt_in_background();
  void schedule_attempt();
  void on_timer();
  void drop(const Status& why);
  void forget_registrations();
  void become_up();
  Status no_answer() const;
  Status flush();
  bool append(const ipc::Envelope& envelope);
  void read_last_words(const Status& why);
  bool read_envelopes(const std::function<bool()>& enough);
  void read_ahead();
  bool wait_until(Deadline deadline, const std::function<bool()>& enough);

  // session_dispatch.cpp: what comes in, and callbacks
  bool parse(std::string_view envelope);
  void handle(const ipc::Envelope& envelope);
  void handle_greeting(const ipc::Envelope& envelope);
  bool take_ring(const ipc::Hello& hello);
  void handle_reply(const ipc::Envelope& envelope);
  void handle_deliver(const ipc::DeliverFrame& deliver);
  void handle_publish_end(std::uint32_t publisher_id, std::uint64_t number, const Status& status);
  void tell_sent(const PublisherState& publisher, const Status& status);
  void report(const Status& status) { post({Event::Kind::kError, {}, {}, status}); }
  void take_reports();
  // session_delivery.cpp: messages, from a frame to a callback
  std::unique_ptr<Message> take_message();
  void give_back(std::unique_ptr<Message> message);
  void wait_in_turn(const std::shared_ptr<SubscriberState>& subscriber,
                    const ipc::DeliverFrame& deliver);
  void drop_waiting(SubscriberState& subscriber, std::size_t index);
  void drop_oldest_message();
  void run_message(SubscriberState& subscriber);
  void hand_over(SubscriberState& subscriber, Message& message);
  void note_loss(SubscriberState& subscriber);
  void report_losses();
  void report_attempt(const Status& status);
  void post(Event event);
  void run_events();
  void run_event(const Event& event);
  void set_default_callbacks();

  // session_requests.cpp: what goes out
  std::uint32_t request(Completion done);
  Status ask(const std::function<void(const ipc::Envelope&)>& use);
  Status require_connection();
  void register_all();
  void register_publisher(const std::shared_ptr<PublisherState>& publisher);
  void register_subscriber(const std::shared_ptr<SubscriberState>& subscriber);
  bool is_impossible(HandleState& handle);
  void register_new(HandleState& handle, const std::function<void()>& register_now);
  void finish_registration(HandleState& handle, const Status& status);
  void unregister_publisher(std::uint32_t id);
  void unregister_subscriber(std::uint32_t id);
  void request_done();
  Status check_publication(const PublisherState& publisher, std::size_t size_bytes,
                           std::optional<std::uint32_t> ttl) const;
  Status check_room(const PublisherState& publisher) const;
  Status append_publication(PublisherState& publisher, std::string_view payload,
                            std::optional<std::uint32_t> ttl);
  void send_pose(const OwnPose& pose);
  void flush_unless_gathering();

  const std::string name_;
  const ClientOptions options_;
  const std::string path_;
  Wakeup wakeup_;
  Connection connection_;
  Phase phase_ = Phase::kDown;
  bool has_started_ = false;   // somebody has asked for a connection
  bool was_up_ = false;        // since the last on_disconnect
  bool is_reconnect_ = false;  // on_reconnect is due when up
  bool is_closed_ = false;
  bool is_connecting_ = false;  // inside connect()
  bool wants_ring_ = true;      // until one could not be used
  bool is_ending_ = false;      // inside read_last_words()
  bool is_processing_ = false;  // inside process(): callbacks may run, writes are gathered
  std::atomic<std::thread::id> processing_thread_{};
  int waits_ = 0;  // waiting calls on the stack: callbacks must not run
  std::atomic<bool> is_stopped_{false};

  Status last_failure_;                         // why the last attempt failed
  std::optional<StatusCode> reported_failure_;  // the same failure is reported once
  std::chrono::milliseconds backoff_;
  std::minstd_rand jitter_;

  std::uint32_t node_id_ = 0;
  std::string daemon_name_;
  std::vector<std::shared_ptr<PublisherState>> publishers_;
  std::vector<std::shared_ptr<SubscriberState>> subscribers_;
  std::unordered_map<std::uint32_t, std::shared_ptr<PublisherState>> publishers_by_id_;
  std::unordered_map<std::uint32_t, std::shared_ptr<SubscriberState>> subscribers_by_id_;
  int registrations_left_ = 0;

  std::uint32_t last_request_id_ = 0;
  std::unordered_map<std::uint32_t, Completion> pending_;
  Status first_refusal_;  // since the last sync()
  bool is_pose_in_flight_ = false;
  std::optional<OwnPose> next_pose_;

  /// Guards what send() of any thread shares with the owner's: what changes of a PublisherState,
  /// the bytes to be written and the socket they go to, and what is below. Held for moments, never
  /// while a callback runs.
  std::mutex gate_;
  std::vector<Status> reports_;  // for on_error, on the owner's thread
  std::atomic<bool> has_reports_{false};

  std::deque<Event> events_;
  std::size_t read_ahead_ = 0;  // messages in events_ of subscribers that read ahead
  bool has_unreported_loss_ = false;
  ipc::Envelope incoming_;
  ipc::Envelope outgoing_;
  Message message_;  // reused; valid during one callback
  std::vector<std::unique_ptr<Message>> spare_messages_;
};

}  // namespace swarmtalk::client
