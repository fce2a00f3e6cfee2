// Lateness: how well a medium in real time keeps its time. What should have happened at one moment
// and was done at another is counted by how far the two lie apart. Owned by the medium.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace swarmtalk::lab::radio {

class Lateness {
 public:
  /// An event is late that is done more than this behind its time: about as much as the air time of
  /// three short frames at 6 Mb/s, and little beside the ticks of robot programs (tens of ms).
  static constexpr std::uint64_t kLateUs = 1000;

  void add(std::uint64_t due_us, std::uint64_t done_us) {
    const std::uint64_t late_us = done_us > due_us ? done_us - due_us : 0;
    ++events_;
    late_ += late_us > kLateUs;
    worst_us_ = std::max(worst_us_, late_us);
    ++by_power_[std::min<std::size_t>(std::bit_width(late_us), by_power_.size() - 1)];
  }

  std::uint64_t events() const { return events_; }
  std::uint64_t late() const { return late_; }
  std::uint64_t worst_us() const { return worst_us_; }

  /// Within how many us this share of the events was done, rounded up to a power of 2; 0: no event.
  std::uint64_t within_us(double share) const {
    const double wanted = share * static_cast<double>(events_);
    std::uint64_t seen = 0;
    for (std::size_t power = 0; power < by_power_.size() && events_ > 0; ++power) {
      seen += by_power_[power];
      if (static_cast<double>(seen) >= wanted) return std::uint64_t{1} << power;
    }
    return 0;
  }

 private:
  std::uint64_t events_ = 0;
  std::uint64_t late_ = 0;
  std::uint64_t worst_us_ = 0;
  std::array<std::uint64_t, 40> by_power_{};  // [p]: 2^(p-1) to 2^p - 1 us
};

}  // namespace swarmtalk::lab::radio
