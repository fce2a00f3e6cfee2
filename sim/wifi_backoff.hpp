// WifiBackoff: when a station of the Wi-Fi medium may send: so many slots after the air has become
// idle, and those it has counted stay counted when the air is taken again. A value.
#pragma once

#include <algorithm>
#include <cstdint>

namespace swarmtalk::sim {

/// Of all stations.
struct WifiSpaces {
  uint32_t slot_us;
  uint32_t difs_us;  // idle air before slots are counted
  uint32_t eifs_us;  // ... when the last frame could not be read
};

class WifiBackoff {
 public:
  /// So many slots are to be counted.
  void set(uint32_t slots) { slots_ = slots; }
  bool is_done() const { return slots_ == 0; }

  /// A frame could not be read, and ended.
  void note_bad_frame(uint64_t at_us) { bad_frame_us_ = at_us; }

  /// The air is idle from now on.
  void begin(uint64_t now_us, const WifiSpaces& spaces) {
    count_from_us_ = now_us + spaces.difs_us;
    if (bad_frame_us_ == 0) return;
    count_from_us_ = std::max(count_from_us_, bad_frame_us_ + spaces.eifs_us);
  }

  /// The air is taken.
  void stop(uint64_t now_us, const WifiSpaces& spaces) {
    if (now_us <= count_from_us_) return;
    const uint64_t counted = (now_us - count_from_us_) / spaces.slot_us;
    slots_ -= static_cast<uint32_t>(std::min<uint64_t>(counted, slots_));
  }

  /// When all is counted, if the air stays idle.
  uint64_t end_us(const WifiSpaces& spaces) const {
    return count_from_us_ + uint64_t{slots_} * spaces.slot_us;
  }

 private:
  uint32_t slots_ = 0;
  uint64_t count_from_us_ = 0;  // when it begins to count, or began
  uint64_t bad_frame_us_ = 0;   // 0: none yet
};

}  // namespace swarmtalk::sim
