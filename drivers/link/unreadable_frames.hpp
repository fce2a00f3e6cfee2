// UnreadableFrames: tells a person that others are on the air whose frames this link cannot read.
// Robots that have another key, release or profile hear nothing of each other, and without a word
// that looks like an empty room. Used by the socket links; owns no clock.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/link/link.hpp"
#include "drivers/link/link_counters.hpp"

namespace swarmtalk::drivers {

class UnreadableFrames {
 public:
  /// Between two lines of one cause: strangers next door may go on for days.
  static constexpr auto kInterval = std::chrono::minutes(1);

  /// Cheap, for every turn of the loop: whether one has come since the last news().
  bool has_news(const LinkCounters& counters) const { return total(counters) != seen_; }

  /// @return a line for each cause whose counter has risen since it was told last, unless that was
  ///   less than kInterval ago
  std::vector<std::string> news(const LinkCounters& counters, MonotonicTime now);

 private:
  static constexpr std::size_t kCauses = 8;
  struct Told {
    std::uint64_t count = 0;
    MonotonicTime at;
  };

  static std::uint64_t total(const LinkCounters& counters) {
    return counters.frames_sealed + counters.frames_without_key + counters.frames_other_key +
           counters.frames_not_authentic + counters.frames_not_fresh +
           counters.frames_other_version + counters.frames_other_profile + counters.frames_tagged;
  }

  std::uint64_t seen_ = 0;
  std::array<Told, kCauses> told_{};
};

}  // namespace swarmtalk::drivers
