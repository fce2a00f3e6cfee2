#include "daemon/session/subscription_queue.hpp"

#include <algorithm>
#include <utility>

namespace swarmtalk::daemon {

bool SubscriptionQueue::push(MessageRef message) {
  bool has_dropped = latest_of_each_ && drop_same_sender(*message);
  if (size_ == keep_last_) {
    drop_oldest();
    has_dropped = true;
  }
  if (size_ == ring_.size()) grow();
  payload_bytes_ += message->payload.size();
  at(size_) = {std::move(message), std::exchange(arriving_, {})};
  ++size_;
  return has_dropped;
}

// Cost: a look at each that waits, at most keep_last.
bool SubscriptionQueue::drop_same_sender(const Message& message) {
  for (std::size_t i = 0; i < size_; ++i) {
    if (at(i).message->sender != message.sender || at(i).message->epoch != message.epoch) continue;
    Taken dropped = std::move(at(i));
    payload_bytes_ -= dropped.message->payload.size();
    for (std::size_t k = i; k + 1 < size_; ++k) at(k) = std::move(at(k + 1));
    --size_;
    ++dropped.lost_before.daemon;
    (i < size_ ? at(i).lost_before : arriving_) += dropped.lost_before;
    return true;
  }
  return false;
}

void SubscriptionQueue::drop_oldest() {
  Taken dropped = take_front();
  ++dropped.lost_before.daemon;
  (is_empty() ? arriving_ : at(0).lost_before) += dropped.lost_before;
}

SubscriptionQueue::Taken SubscriptionQueue::pop() {
  return take_front();
}

SubscriptionQueue::Taken SubscriptionQueue::take_front() {
  Taken taken = std::move(ring_[first_]);
  first_ = --size_ == 0 ? 0 : (first_ + 1) % ring_.size();
  payload_bytes_ -= taken.message->payload.size();
  if (size_ == 0 && ring_.size() > kKeptPlaces) ring_ = {};
  return taken;
}

void SubscriptionQueue::grow() {
  std::rotate(ring_.begin(), ring_.begin() + static_cast<std::ptrdiff_t>(first_), ring_.end());
  first_ = 0;
  ring_.resize(std::min(keep_last_, std::max<std::size_t>(8, ring_.size() * 2)));
}

}  // namespace swarmtalk::daemon
