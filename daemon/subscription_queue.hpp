// SubscriptionQueue: the messages that wait for one subscription, oldest first, at most
// `keep_last`. When it is full the oldest goes, and the next message taken out tells how many went
// before it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/message.hpp"

namespace swarmtalk::daemon {

class SubscriptionQueue {
 public:
  /// @param keep_last  at least 1. Memory grows to it only when so many wait.
  explicit SubscriptionQueue(std::size_t keep_last) : keep_last_(keep_last) {}

  struct Taken {
    MessageRef message;
    std::uint32_t dropped_before = 0;
  };

  /// Appends. @return true when the oldest was dropped for it
  bool push(MessageRef message);

  /// Drops the oldest. @pre not empty
  void drop_oldest();

  /// Counts a message as dropped that never got in.
  void count_dropped() { ++dropped_; }

  /// Takes the oldest out. @pre not empty
  Taken pop();

  bool is_empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  std::size_t payload_bytes() const { return payload_bytes_; }

 private:
  MessageRef take_front();
  void grow();

  std::vector<MessageRef> ring_;
  std::size_t keep_last_;
  std::size_t first_ = 0;
  std::size_t size_ = 0;
  std::size_t payload_bytes_ = 0;
  std::uint32_t dropped_ = 0;  // since the last pop
};

}  // namespace swarmtalk::daemon
