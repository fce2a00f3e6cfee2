// Deliveries: what a program is told, in the order in which it happened: messages, what became of
// its own, the connection's loss and return, failures. Callbacks run in run(), or at once where
// that is allowed; until then all waits here, within limits. On the owner's thread.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <swarmtalk/client.hpp>

#include "client_lib/reports.hpp"
#include "client_lib/state.hpp"
#include "client_lib/wakeup.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::client {

/// The program's; each may be empty, and may replace itself.
struct Callbacks {
  std::function<void(const Status&)> on_disconnect;
  std::function<void()> on_reconnect;
  std::function<void(const Message&)> on_gap;
  std::function<void(const Status&)> on_error;
};

/// Before why one of a program's messages was not.
constexpr const char* kNotSent = "a message was not sent: ";

class Deliveries {
 public:
  /// Begins with callbacks that print to stderr. @param wake  called when something begins to wait
  Deliveries(Reports& reports, std::function<void()> wake);

  Callbacks& callbacks() { return callbacks_; }

  /// A cause of failures, as the usual on_error has told it.
  struct Told {
    Wakeup::Clock::time_point at{};
    std::uint64_t untold = 0;  // since then
    std::string text;          // of the last
  };

  // @param may_call  callbacks may run now: what happened is told at once if nothing waits before
  // it
  void deliver(const std::shared_ptr<SubscriberState>& subscriber, const ipc::DeliverFrame& frame,
               bool may_call);
  void tell_sent(const std::shared_ptr<PublisherState>& publisher, const Status& status,
                 bool may_call);

  // These wait for run().
  void post_disconnect(const Status& why) { post({Event::Kind::kDisconnect, {}, {}, why}); }
  void post_reconnect() { post({Event::Kind::kReconnect, {}, {}, {}}); }
  void report(const Status& status) { post({Event::Kind::kError, {}, {}, status}); }
  /// What no call's answer has told. A program that ends before run() is told at its end.
  void report_untold(const Status& status) { post({Event::Kind::kUntold, {}, {}, status}); }

  /// Runs the callbacks of all that waits.
  void run();

  std::size_t size() const { return events_.size(); }
  /// Messages wait of which only the newest or the young count: more should be read before run().
  bool has_read_ahead() const { return read_ahead_ > 0; }

  /// Whether subscribers have lost messages here since the last call: their unreported_loss.
  bool take_has_loss() { return std::exchange(has_unreported_loss_, false); }

  /// Nothing is told from now on. @param tells_stderr  what failed and nobody was told is printed
  void close(bool tells_stderr);

 private:
  struct Event {
    enum class Kind { kMessage, kSent, kDisconnect, kReconnect, kError, kUntold };
    Kind kind;
    std::shared_ptr<SubscriberState> subscriber;
    std::shared_ptr<PublisherState> publisher;
    Status status;
  };

  std::unique_ptr<Message> take_message();
  void give_back(std::unique_ptr<Message> message);
  void wait_in_turn(const std::shared_ptr<SubscriberState>& subscriber,
                    const ipc::DeliverFrame& deliver);
  void drop_waiting(SubscriberState& subscriber, std::size_t index);
  void drop_oldest_message();
  void run_message(SubscriberState& subscriber);
  void hand_over(SubscriberState& subscriber, Message& message);
  void note_loss(SubscriberState& subscriber);
  void run_sent(const PublisherState& publisher, const Status& status);
  void post(Event event);
  void run_event(const Event& event);
  void take_reports();
  void print_failures();
  void set_default_callbacks();

  Reports& reports_;
  std::function<void()> wake_;
  std::shared_ptr<std::map<StatusCode, Told>> told_ =
      std::make_shared<std::map<StatusCode, Told>>();
  Callbacks callbacks_;
  std::deque<Event> events_;
  std::size_t read_ahead_ = 0;  // messages in events_ of subscribers that read ahead
  bool has_unreported_loss_ = false;
  bool is_closed_ = false;
  Message message_;  // reused; valid during one callback
  std::vector<std::unique_ptr<Message>> spare_messages_;
};

}  // namespace swarmtalk::client
