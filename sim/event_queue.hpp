// What happens when, in the simulation: a calendar queue. Events go into buckets of 1.024 ms; only
// the bucket that is being worked off is sorted. Cost per event does not grow with their number.
// Events at the same time come in the order of `what`, so the order never depends on history.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <queue>
#include <vector>

namespace swarmtalk::sim {

struct Event {
  uint64_t at_us;
  uint32_t what;

  bool operator<(const Event& other) const {
    return at_us != other.at_us ? at_us < other.at_us : what < other.what;
  }
  bool operator>(const Event& other) const { return other < *this; }
};

class EventQueue {
 public:
  EventQueue() : buckets_(kBuckets) {}

  /// @param at_us  not before the event that was popped last
  void push(uint64_t at_us, uint32_t what) {
    const Event event{at_us, what};
    const uint64_t slot = at_us >> kBucketBits;
    if (slot <= slot_) {
      today_.insert(std::upper_bound(today_.begin() + static_cast<std::ptrdiff_t>(next_),
                                     today_.end(), event),
                    event);
    } else if (slot < slot_ + kBuckets) {
      buckets_[slot % kBuckets].push_back(event);
    } else {
      far_.push(event);
    }
  }

  /// Takes the next event that is due by `end_us`. @return false if there is none
  bool pop(uint64_t end_us, Event& out) {
    while (next_ == today_.size()) {
      if (slot_ >= end_us >> kBucketBits) return false;
      open_next_bucket();
    }
    if (today_[next_].at_us > end_us) return false;
    out = today_[next_++];
    return true;
  }

  /// When the next event is due, if that is by `end_us`.
  std::optional<uint64_t> next_us(uint64_t end_us) {
    while (next_ == today_.size()) {
      if (slot_ >= end_us >> kBucketBits) return std::nullopt;
      open_next_bucket();
    }
    if (today_[next_].at_us > end_us) return std::nullopt;
    return today_[next_].at_us;
  }

  /// The event that is `ahead` places behind the next one, if it is known already: for prefetching.
  const Event* peek(std::size_t ahead) const {
    return next_ + ahead < today_.size() ? &today_[next_ + ahead] : nullptr;
  }

 private:
  static constexpr unsigned kBucketBits = 10;
  static constexpr uint64_t kBuckets = 2048;  // 2.1 s ahead; what is later waits in far_

  void open_next_bucket() {
    ++slot_;
    next_ = 0;
    today_.clear();
    today_.swap(buckets_[slot_ % kBuckets]);
    while (!far_.empty() && far_.top().at_us >> kBucketBits < slot_ + kBuckets) {
      const Event event = far_.top();
      far_.pop();
      const uint64_t slot = event.at_us >> kBucketBits;
      (slot == slot_ ? today_ : buckets_[slot % kBuckets]).push_back(event);
    }
    std::sort(today_.begin(), today_.end());
  }

  std::vector<std::vector<Event>> buckets_;
  std::vector<Event> today_;  // bucket slot_, sorted
  std::size_t next_ = 0;      // in today_
  uint64_t slot_ = 0;
  std::priority_queue<Event, std::vector<Event>, std::greater<Event>> far_;
};

}  // namespace swarmtalk::sim
