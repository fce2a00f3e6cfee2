// Engine: what is behind a Client: it joins the parts, each of which knows its own only, and turns
// the event loop. Entrance lets one thread in, ConnectionKeeper holds the connection, Inbox takes
// what comes, Requests and Handles talk with the daemon, Registration makes new handles known to
// it, Questions and PoseUpdates are what a program asks and tells it, Sender takes messages of any
// thread, Deliveries is what the program is told, Hints what its programmer is. User callbacks run
// only inside process(); what a waiting call (connect, a registration, get_status) meets on the way
// waits in Deliveries.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <swarmtalk/client.hpp>

#include "client_lib/connection.hpp"
#include "client_lib/connection_keeper.hpp"
#include "client_lib/deliveries.hpp"
#include "client_lib/entrance.hpp"
#include "client_lib/handles.hpp"
#include "client_lib/hints.hpp"
#include "client_lib/inbox.hpp"
#include "client_lib/pose_updates.hpp"
#include "client_lib/questions.hpp"
#include "client_lib/refusals.hpp"
#include "client_lib/registration.hpp"
#include "client_lib/reports.hpp"
#include "client_lib/requests.hpp"
#include "client_lib/sender.hpp"
#include "client_lib/silence.hpp"
#include "client_lib/state.hpp"
#include "client_lib/wakeup.hpp"

namespace swarmtalk::client {

class Engine : public std::enable_shared_from_this<Engine> {
 public:
  Engine(std::string_view name, const ClientOptions& options);
  ~Engine();

  // The functions of Client; contracts in client.hpp.
  Status connect();
  bool is_connected() const { return keeper_.is_up(); }
  Status set_pose(const OwnPose& pose);
  Status get_status(DaemonStatus& status);
  Status get_neighbours(std::vector<Neighbour>& neighbours);
  Status get_pose(std::optional<Pose>& pose);
  Status sync();
  std::uint32_t node_id() const { return keeper_.node_id(); }
  const std::string& daemon_name() const { return keeper_.daemon_name(); }
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
  void tell_unread(const std::string& channel, const std::string& why, bool is_unread);
  bool is_busy(const PublisherState& publisher);
  std::mutex& gate() { return gate_; }
  /// In a child of fork(): what it is told. None: it is no child.
  std::optional<Status> refusal_of_child();
  void remove(PublisherState& publisher);
  void remove(SubscriberState& subscriber);

  /// The Client is gone: no callback after this, handles answer kDisconnected.
  void close();
  /// The program ends, and the Client is still there: what send() took goes out first.
  void end_with_program();

 private:
  ConnectionKeeper::Hooks keeper_hooks();
  Registration::Hooks registration_hooks();
  void write_requests();
  Status process_inside();
  void look_for_answers();
  void read_ahead();
  template <typename State>
  std::shared_ptr<State> add(const std::shared_ptr<State>& handle);
  void learn_the_rest();
  void report_losses();

  const std::chrono::milliseconds request_timeout_;
  Wakeup wakeup_;
  Connection connection_;
  bool is_closed_ = false;
  bool is_loss_untold_ = false;  // of the connection: process() has not been called since
  bool is_processing_ = false;   // inside process(): callbacks may run
  std::atomic<bool> is_stopped_{false};

  /// Guards what send() of any thread shares with the owner's: what changes of a PublisherState,
  /// the bytes to be written and the socket they go to. Held for moments, never while a callback
  /// runs.
  std::mutex gate_;
  Reports reports_;
  Entrance entrance_;
  Refusals refusals_;
  Hints hints_;
  Deliveries deliveries_;
  Requests requests_;
  Handles handles_;
  PoseUpdates poses_;
  Sender sender_;
  Silence silence_;
  Inbox inbox_;
  ConnectionKeeper keeper_;
  Questions questions_;
  Registration registration_;
};

}  // namespace swarmtalk::client
