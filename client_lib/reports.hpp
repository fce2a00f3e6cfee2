// Reports: failures that threads other than the owner's met while they sent, until the owner tells
// the program of them. Any thread.
#pragma once

#include <atomic>
#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

#include <swarmtalk/client/status.hpp>

namespace swarmtalk::client {

class Reports {
 public:
  /// Those beyond kMost are left out: they would say the same.
  void add(const Status& status) {
    const std::lock_guard lock(mutex_);
    if (reports_.size() >= kMost) return;
    reports_.push_back(status);
    has_any_.store(true);
  }
  bool has_any() const { return has_any_.load(); }
  std::vector<Status> take() {
    const std::lock_guard lock(mutex_);
    has_any_.store(false);
    return std::exchange(reports_, {});
  }

 private:
  static constexpr std::size_t kMost = 16;

  std::mutex mutex_;
  std::vector<Status> reports_;
  std::atomic<bool> has_any_{false};
};

}  // namespace swarmtalk::client
