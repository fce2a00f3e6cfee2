#include "daemon/subscription_queue.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::daemon {

bool SubscriptionQueue::push(MessageRef message) {
  const bool is_full = size_ == keep_last_;
  if (is_full) drop_oldest();
  if (size_ == ring_.size()) grow();
  payload_bytes_ += message->payload.size();
  ring_[(first_ + size_) % ring_.size()] = std::move(message);
  ++size_;
  return is_full;
}

void SubscriptionQueue::drop_oldest() {
  take_front().reset();
  ++dropped_;
}

SubscriptionQueue::Taken SubscriptionQueue::pop() {
  return {take_front(), std::exchange(dropped_, 0)};
}

MessageRef SubscriptionQueue::take_front() {
  MessageRef message = std::move(ring_[first_]);
  first_ = (first_ + 1) % ring_.size();
  --size_;
  payload_bytes_ -= message->payload.size();
  return message;
}

void SubscriptionQueue::grow() {
  std::rotate(ring_.begin(), ring_.begin() + static_cast<std::ptrdiff_t>(first_), ring_.end());
  first_ = 0;
  ring_.resize(std::min(keep_last_, std::max<std::size_t>(8, ring_.size() * 2)));
}

}  // namespace swarmtalk::daemon
