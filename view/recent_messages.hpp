// RecentMessages: the last messages of each channel of a recording, so that a window which is
// opened, or whose time has jumped, shows what led to that moment. Bounded; reads no clock.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>

#include "view/traffic.hpp"

namespace swarmtalk::view {

class RecentMessages {
 public:
  static constexpr std::size_t kMostOfAChannel = 200;
  static constexpr std::size_t kMostBytesOfAChannel = 64 * 1024;  // beyond: the newest alone
  static constexpr std::size_t kMostChannels = Traffic::kMostChannels;

  void clear() { by_channel_.clear(); }

  void add(const HeardMessage& message) {
    if (!by_channel_.contains(message.channel) && by_channel_.size() >= kMostChannels) {
      by_channel_.erase(most_silent());
    }
    Kept& kept = by_channel_[message.channel];
    kept.messages.push_back(message);
    kept.bytes += message.payload.size();
    while (kept.messages.size() > kMostOfAChannel ||
           (kept.bytes > kMostBytesOfAChannel && kept.messages.size() > 1)) {
      kept.bytes -= kept.messages.front().payload.size();
      kept.messages.pop_front();
    }
  }

  /// The oldest first.
  const std::deque<HeardMessage>& of(std::uint16_t channel) const {
    static const std::deque<HeardMessage> kNone;
    const auto found = by_channel_.find(channel);
    return found == by_channel_.end() ? kNone : found->second.messages;
  }

 private:
  struct Kept {
    std::deque<HeardMessage> messages;
    std::size_t bytes = 0;
  };
  using ByChannel = std::map<std::uint16_t, Kept>;

  ByChannel::iterator most_silent() {
    return std::min_element(by_channel_.begin(), by_channel_.end(),
                            [](const auto& a, const auto& b) {
                              return a.second.messages.back().at < b.second.messages.back().at;
                            });
  }

  ByChannel by_channel_;
};

}  // namespace swarmtalk::view
