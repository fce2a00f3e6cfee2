// The packets that the overhead controller sent last. The gateway Kilobot sits in its light and
// reports them like a robot's, so the link asks here what is its own. Used by KilobotLink, on its
// thread.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

#include "kilobot_bridge/frame_builder.hpp"

namespace swarmtalk::kilobot_bridge {

class SentPackets {
 public:
  /// @param packet  as it leaves, padded with zeros; takes the place of the oldest
  void remember(const IrData& packet) {
    packets_[next_] = packet;
    next_ = (next_ + 1) % packets_.size();
    size_ = std::min(size_ + 1, packets_.size());
  }

  /// @param packet  at most sizeof(IrData) bytes. @return whether one that was sent begins with it
  bool contains(std::span<const std::uint8_t> packet) const {
    return std::any_of(packets_.begin(), packets_.begin() + size_, [&](const IrData& sent) {
      return std::equal(packet.begin(), packet.end(), sent.begin());
    });
  }

 private:
  // Two seconds at the highest rate, 23/s; a report takes far less. No time limit beside it: a
  // controller that missed its STOP repeats its last message for ever.
  std::array<IrData, 64> packets_{};
  std::size_t next_ = 0;
  std::size_t size_ = 0;
};

}  // namespace swarmtalk::kilobot_bridge
