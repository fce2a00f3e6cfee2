// SubscriptionQueue: the messages that wait for one subscription, oldest first, at most
// `keep_last`; of each sender only the newest, if so asked. What is dropped is told by the next
// message taken out, beside what was lost before it came here.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/message/loss.hpp"
#include "daemon/message/message.hpp"

namespace swarmtalk::daemon {

class SubscriptionQueue {
 public:
  /// @param keep_last  at least 1. Memory grows to it only when so many wait, and goes when none
  /// do.
  /// @param latest_of_each  a message takes the place of its sender's one before, at the end
  explicit SubscriptionQueue(std::size_t keep_last, bool latest_of_each = false)
      : keep_last_(keep_last), latest_of_each_(latest_of_each) {}

  struct Taken {
    MessageRef message;
    Loss lost_before;
  };

  /// Appends. @return true when another was dropped for it
  bool push(MessageRef message);

  /// Lost before the next push().
  void note(const Loss& loss) { arriving_ += loss; }

  /// Drops the oldest. @pre not empty
  void drop_oldest();

  /// Counts a message as dropped that never got in.
  void count_dropped() { ++arriving_.daemon; }

  /// Takes the oldest out. @pre not empty
  Taken pop();

  /// @pre not empty
  const Message& front() const { return *ring_[first_].message; }
  bool is_empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  std::size_t payload_bytes() const { return payload_bytes_; }

 private:
  Taken take_front();
  bool drop_same_sender(const Message& message);
  Taken& at(std::size_t index) { return ring_[(first_ + index) % ring_.size()]; }
  void grow();

  static constexpr std::size_t kKeptPlaces = 64;  // also while empty

  std::vector<Taken> ring_;
  std::size_t keep_last_;
  bool latest_of_each_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  std::size_t payload_bytes_ = 0;
  Loss arriving_;  // goes with the next push()
};

}  // namespace swarmtalk::daemon
