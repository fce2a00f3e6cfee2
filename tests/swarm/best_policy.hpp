// The bound for receivers with little memory: an ideal receiver that is told who sends, which
// message, and how long messages are, forgets nothing and counts only fragments; it does not know
// which packets will be lost. Two policies, both online; the bound is the better one.
//   greedy:   begin a message when a slot is free; when none is, drop the one that has come least
//   forecast: begin a message only if all begun ones will fit until they end, sent at one pace
// A message is dropped as soon as a gap shows that it cannot be completed.
#pragma once

#include <cstdint>
#include <map>

namespace swarmtalk::core::testing {

class IdealReceiver {
 public:
  enum class Policy { kGreedy, kForecast };

  IdealReceiver(Policy policy, uint32_t slots, uint32_t packets)
      : policy_(policy), slots_(slots), packets_(packets) {}

  /// @return true if this packet completes a message
  bool hear(uint32_t sender, uint32_t message, uint32_t sequence) {
    if (packets_ == 1) return true;
    auto it = held_.find(sender);
    if (it != held_.end() && (it->second.message != message || it->second.count != sequence)) {
      drop(it);
      it = held_.end();
    }
    if (it == held_.end()) {
      if (sequence == 0 && may_begin()) {
        held_[sender] = {message, 1};
        ++used_;
      }
      return false;
    }
    if (sequence + 1 == packets_) {
      drop(it);
      return true;
    }
    if (used_ == slots_ && !make_room(it)) return false;
    ++it->second.count;
    ++used_;
    return false;
  }

 private:
  struct Held {
    uint32_t message;
    uint32_t count;
  };
  using Map = std::map<uint32_t, Held>;

  void drop(Map::iterator it) {
    used_ -= it->second.count;
    held_.erase(it);
  }
  bool may_begin() const {
    if (used_ == slots_) return false;
    if (policy_ == Policy::kGreedy) return true;
    for (uint32_t later = 0; later + 1 < packets_; ++later) {
      uint32_t need = 1 + later;
      for (const auto& [sender, held] : held_) {
        if (held.count + later < packets_) need += held.count + later;
      }
      if (need > slots_) return false;
    }
    return true;
  }
  bool make_room(Map::iterator wanted) {
    auto least = held_.end();
    for (auto it = held_.begin(); it != held_.end(); ++it) {
      if (it->second.count < wanted->second.count &&
          (least == held_.end() || it->second.count < least->second.count)) {
        least = it;
      }
    }
    if (least == held_.end()) {
      drop(wanted);
      return false;
    }
    drop(least);
    return true;
  }

  Policy policy_;
  uint32_t slots_;
  uint32_t packets_;
  uint32_t used_ = 0;
  Map held_;
};

}  // namespace swarmtalk::core::testing
