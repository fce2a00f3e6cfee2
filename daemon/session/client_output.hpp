// ClientOutput: what waits to be written to one client: answers first, then deliveries,
// subscriptions in turn. All of it is bounded; what is dropped is counted, and told with the
// delivery after it. It does no I/O: Session writes what unwritten() shows and says how far it
// came.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "daemon/common/daemon_counters.hpp"
#include "daemon/config/config.hpp"
#include "daemon/hub/hub_client.hpp"
#include "daemon/session/subscription_queue.hpp"
#include "ipc/framing.hpp"
#include "ipc/message_frames.hpp"

namespace swarmtalk::daemon {

struct QueuedSubscription : Subscription {
  QueuedSubscription(std::size_t keep_last, bool latest_of_each)
      : queue(keep_last, latest_of_each) {}
  SubscriptionQueue queue;
  std::optional<std::uint32_t> max_age_ms;
  bool is_ready = false;  // listed by ClientOutput
};

class ClientOutput {
 public:
  /// References must outlive it. @param wake  called whenever something has come to be written
  ClientOutput(const LimitsConfig& limits, DaemonCounters& counters, std::function<void()> wake)
      : limits_(limits), counters_(counters), wake_(std::move(wake)) {}

  /// Ahead of all deliveries that are not being written yet. Instead of one that fits no frame the
  /// client gets a failure.
  void add_answer(const ipc::Envelope& answer);
  void add_answer(const ipc::SentFrame& answer);
  std::size_t answer_bytes() const { return answers_.size(); }
  /// So many answers wait that nothing more should be asked until the client has read some.
  bool is_full() const { return !is_closed_ && answers_.size() > limits_.reply_bytes; }

  /// Queues a message. It takes what was lost before it from the subscription.
  void add_delivery(QueuedSubscription& subscription, const MessageRef& message);
  /// The subscription ends: what it still has queued is dropped.
  void forget(QueuedSubscription& subscription);

  /// Before writing: answers that have come overtake deliveries not yet begun.
  void put_answers_ahead();
  /// All of unwritten() is written: takes what comes next. @return false: nothing waits
  bool refill();
  std::string_view unwritten() const { return std::string_view(bytes_).substr(written_); }
  void advance(std::size_t bytes) { written_ += bytes; }
  bool is_empty() const { return written_ == bytes_.size() && answers_.empty() && ready_.empty(); }

  /// Nothing more is taken.
  void close() { is_closed_ = true; }

  std::size_t waiting_bytes() const { return queued_bytes_ + unwritten().size() + answers_.size(); }
  std::uint64_t deliveries_sent() const { return deliveries_sent_; }
  /// Deliveries lost by these queues.
  std::uint64_t lost() const { return lost_; }

 private:
  /// What a queue holds is taken from the sums, and put back when it has changed.
  void begin_change(const SubscriptionQueue& queue);
  void end_change(const SubscriptionQueue& queue);
  bool is_over(std::size_t more_bytes) const;
  void drop_old(QueuedSubscription& subscription, std::uint64_t now_ns);
  void append(QueuedSubscription& subscription);

  const LimitsConfig& limits_;
  DaemonCounters& counters_;
  std::function<void()> wake_;
  std::string answers_;  // framed, not yet in bytes_
  std::string bytes_;    // framed, being written
  std::size_t written_ = 0;
  std::size_t answers_end_ = 0;            // in bytes_; behind it are deliveries only
  std::deque<QueuedSubscription*> ready_;  // with messages queued; served in turn
  std::size_t queued_bytes_ = 0;           // payload in all queues
  std::size_t queued_messages_ = 0;        // in all of them
  std::uint64_t deliveries_sent_ = 0;
  std::uint64_t lost_ = 0;
  bool is_closed_ = false;
};

}  // namespace swarmtalk::daemon
