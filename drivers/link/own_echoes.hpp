// OwnEchoes: which of the frames from our own hardware address are our own, come back. Another
// robot may have that address too: by a copied card, or an adapter without one of its own.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "drivers/link/link.hpp"

namespace swarmtalk::drivers {

class OwnEchoes {
 public:
  /// An access point may hold a frame for a while: for so long what comes may be of the daemon that
  /// was here before.
  static constexpr auto kLongestHeld = std::chrono::seconds(5);

  void begin(std::uint32_t epoch, MonotonicTime now) {
    begun_at_ = now;
    for (auto byte = epoch_.rbegin(); byte != epoch_.rend(); ++byte, epoch >>= 8) {
      *byte = static_cast<std::uint8_t>(epoch);
    }
  }

  /// @param frame  air frame from our own address, not parsed: most are ours
  bool is_ours(std::span<const std::uint8_t> frame, MonotonicTime now) const {
    if (frame.size() < frame::kHeaderBytes || now - begun_at_ < kLongestHeld) return true;
    return std::equal(epoch_.begin(), epoch_.end(), frame.begin() + frame::kEpochAt);
  }

 private:
  std::array<std::uint8_t, 4> epoch_{};
  MonotonicTime begun_at_{};
};

}  // namespace swarmtalk::drivers
