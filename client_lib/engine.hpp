// Engine: the state machine behind a Client: connects, greets, reads, reconnects. Single thread,
// the Client's owner. What it meets goes to its parts: Requests and Handles towards the daemon,
// Sender for messages of any thread, Deliveries towards the program. User callbacks run only inside
// process(); what a waiting call (connect, a registration, get_status) meets on the way is kept in
// Deliveries until then.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <swarmtalk/client.hpp>

#include "client_lib/connection.hpp"
#include "client_lib/deliveries.hpp"
#include "client_lib/handles.hpp"
#include "client_lib/refusals.hpp"
#include "client_lib/reports.hpp"
#include "client_lib/requests.hpp"
#include "client_lib/sender.hpp"
#include "client_lib/state.hpp"
#include "client_lib/wakeup.hpp"
#include "ipc/framing.hpp"

namespace swarmtalk::client {

class Engine : public std::enable_shared_from_this<Engine> {
 public:
  Engine(std::string_view name, ClientOptions options);
  ~Engine();

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
  Callbacks& callbacks() { return deliveries_.callbacks(); }
  void tell_errors_to_program() { refusals_.tells_stderr(false); }
  std::optional<Publisher> log_publisher;  // of Client::log(); none: not called yet

  // The functions of Channel, Publisher and Subscriber.
  std::shared_ptr<PublisherState> add_publisher(std::shared_ptr<const ChannelKey> key,
                                                SentCallback sent, Sending sending);
  std::shared_ptr<SubscriberState> add_subscriber(std::shared_ptr<const ChannelKey> key,
                                                  ReceiveCallback receive, Policy policy);
  /// Any thread.
  Status publish(PublisherState& publisher, std::string_view payload,
                 std::optional<std::uint32_t> ttl);
  void tell_unread(const std::string& channel, const std::string& why);
  bool is_busy(const PublisherState& publisher) { return sender_.is_busy(publisher); }
  std::mutex& gate() { return gate_; }
  void remove(PublisherState& publisher) { handles_.remove(publisher); }
  void remove(SubscriberState& subscriber);

  /// The Client is gone: no callback after this, handles answer kDisconnected.
  void close();

 private:
  enum class Phase { kDown, kGreeting, kRegistering, kUp };
  using Deadline = Wakeup::Clock::time_point;
  // engine.cpp: the connection's life
  Status check_outside();
  Status attempt();
  void attempt_in_background();
  void schedule_attempt();
  void on_timer();
  void drop(const Status& why);
  void become_up();
  Status no_answer() const;
  Status flush();
  void read_last_words(const Status& why);
  bool read_envelopes(const std::function<bool()>& enough);
  void read_ahead();
  bool wait_until(Deadline deadline, const std::function<bool()>& enough);

  // engine_dispatch.cpp: what comes in
  bool parse(std::string_view envelope);
  void handle(const ipc::Envelope& envelope);
  void handle_greeting(const ipc::Envelope& envelope);
  bool take_ring(const ipc::Hello& hello);
  void report_attempt(const Status& status);

  // engine_requests.cpp: what a program asks
  Status ask(const std::function<void(const ipc::Envelope&)>& use);
  Status require_connection();
  bool is_impossible(HandleState& handle);
  void register_new(HandleState& handle, const std::function<void()>& register_now);
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
  bool has_processed_ = false;  // process() was called
  bool is_connecting_ = false;  // inside connect()
  bool wants_ring_ = true;      // until one could not be used
  bool is_ending_ = false;      // inside read_last_words()
  bool is_processing_ = false;  // inside process(): callbacks may run, writes are gathered
  std::atomic<std::thread::id> processing_thread_{};
  int waits_ = 0;  // waiting calls on the stack: callbacks must not run
  std::atomic<bool> is_stopped_{false};

  /// Guards what send() of any thread shares with the owner's: what changes of a PublisherState,
  /// the bytes to be written and the socket they go to. Held for moments, never while a callback
  /// runs.
  std::mutex gate_;
  Reports reports_;
  Refusals refusals_;
  Deliveries deliveries_;
  Requests requests_;
  Handles handles_;
  Sender sender_;

  Status last_failure_;                         // why the last attempt failed
  std::optional<StatusCode> reported_failure_;  // the same failure is reported once
  std::chrono::milliseconds backoff_;
  std::minstd_rand jitter_;

  std::uint32_t node_id_ = 0;
  std::string daemon_name_;
  bool is_pose_in_flight_ = false;
  std::optional<OwnPose> next_pose_;

  ipc::Envelope incoming_;
};

}  // namespace swarmtalk::client
