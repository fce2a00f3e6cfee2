// LastMessages: the number of the last message of each channel that has left, or of which no more
// than a part will, for beacons. A beacon has room for some; all have their turn.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>

#include "frame/air_frame.hpp"

namespace swarmtalk::daemon {

class LastMessages {
 public:
  /// Where the number of a channel is kept; stays valid. From the first call on it is told.
  std::uint32_t& of(std::uint16_t channel) { return left_[channel]; }

  /// The next ones. @return how many
  std::size_t take(std::span<frame::LastMessage> out) {
    const std::size_t count = std::min(out.size(), left_.size());
    auto next = left_.upper_bound(told_channel_);
    for (std::size_t i = 0; i < count; ++i, ++next) {
      if (next == left_.end()) next = left_.begin();
      out[i] = {next->first, next->second};
      told_channel_ = next->first;
    }
    return count;
  }

 private:
  std::map<std::uint16_t, std::uint32_t> left_;
  std::uint16_t told_channel_ = 0;  // the last that was taken
};

}  // namespace swarmtalk::daemon
