// ConnectionKeeper: keeps a program connected with its daemon: attempts with back-off, greeting,
// what is read and written, loss. It knows nothing of what is said after the greeting: that goes to
// its hooks. Used by Engine, on the owner's thread; it calls no user code itself.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include <swarmtalk/client.hpp>

#include "client_lib/backoff.hpp"
#include "client_lib/connection.hpp"
#include "client_lib/wakeup.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::client {

class ConnectionKeeper {
 public:
  using Deadline = Wakeup::Clock::time_point;

  struct Hooks {
    // What came. `may_call`: nobody waits, so callbacks of the program may run.
    std::function<void(const ipc::DeliverFrame&, bool may_call)> on_message;
    std::function<void(const ipc::Envelope&, bool may_call)> on_envelope;
    std::function<void()> on_greeted;  // to be answered with become_up(), now or later
    std::function<void()> on_return;   // up again
    std::function<void(const Status& why)> on_loss;     // of a connection that was up
    std::function<void(const Status& why)> on_failure;  // of attempts; the same one is told once
    std::function<void()> on_down;  // after each of the two: nothing is answered
  };

  /// All must outlive it. @param gate  guards `connection` and what is_up() is to other threads
  ConnectionKeeper(std::string name, const ClientOptions& options, std::mutex& gate, Wakeup& wakeup,
                   Connection& connection, Hooks hooks);

  /// Contract of Client::connect().
  Status connect();
  /// kOk, or why nothing can be asked now; connects if nobody has tried yet.
  Status require();
  /// One attempt; a failure goes to on_failure.
  void attempt_in_background();
  /// When the timer has expired: the next attempt, or the end of one.
  void on_timer();
  /// All that is needed is registered on this connection.
  void become_up();
  /// For good.
  void close();

  bool has_started() const { return has_started_; }  // somebody has asked for a connection
  bool is_up() const { return phase_ == Phase::kUp; }
  bool is_greeted() const { return phase_ == Phase::kRegistering || is_up(); }
  std::uint32_t node_id() const { return node_id_; }
  const std::string& daemon_name() const { return daemon_name_; }

  /// Writes what waits. @return why the connection is lost
  Status flush();
  /// Reads once and hands on what has come, until `enough`; more stays for the next call.
  /// @return whether the socket may have more
  bool read(const std::function<bool()>& enough);
  /// Reads once; no callbacks are run.
  void look();
  /// Waits; no callbacks are run. @return enough()
  bool wait_until(Deadline deadline, const std::function<bool()>& enough);

 private:
  enum class Phase { kDown, kGreeting, kRegistering, kUp };

  Status attempt();
  void schedule_attempt();
  void drop(const Status& why);
  Status no_answer() const;
  void read_last_words(const Status& why);
  bool parse(std::string_view envelope);
  void handle(const ipc::Envelope& envelope);
  void handle_greeting(const ipc::Envelope& envelope);
  void report_attempt(const Status& status);

  const std::string name_;
  const std::string path_;
  const std::chrono::milliseconds timeout_;
  std::mutex& gate_;
  Wakeup& wakeup_;
  Connection& connection_;
  const Hooks hooks_;

  Phase phase_ = Phase::kDown;
  bool has_started_ = false;
  bool was_up_ = false;         // since the last on_loss
  bool is_reconnect_ = false;   // on_return is due when up
  bool is_connecting_ = false;  // inside connect()
  bool is_ending_ = false;      // inside read_last_words()
  int waits_ = 0;               // waiting calls on the stack: callbacks must not run
  Backoff backoff_;
  Status last_failure_;                         // why the last attempt failed
  std::optional<StatusCode> reported_failure_;  // the same failure is reported once

  std::uint32_t node_id_ = 0;
  std::string daemon_name_;
  ipc::Envelope incoming_;
};

}  // namespace swarmtalk::client
