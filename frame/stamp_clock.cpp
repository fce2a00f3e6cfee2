#include "frame/stamp_clock.hpp"

#include <algorithm>

namespace swarmtalk::frame {
namespace {

/// Milliseconds from one stamp to another, either way: up to 23 hours.
std::int64_t between_ms(std::uint32_t from, std::uint32_t to) {
  const std::uint32_t ahead = (to - from) & StampClock::kMask;
  const std::int64_t steps = ahead <= StampClock::kMask / 2
                                 ? std::int64_t{ahead}
                                 : std::int64_t{ahead} - (StampClock::kMask + 1);
  return steps * static_cast<std::int64_t>(StampClock::kStampMs);
}

}  // namespace

void StampClock::prove(std::uint32_t stamp, Ms drawn_at, Ms at) {
  const Ms by_old = sent_at(stamp);
  const Ms least = drift(at) + kStampMs;
  const Ms earliest = by_old > least ? by_old - least : 0;
  base_at_ = by_old <= at + kStampMs ? std::max(earliest, drawn_at) : drawn_at;
  base_stamp_ = stamp;
}

StampClock::Ms StampClock::sent_at(std::uint32_t stamp) const {
  const std::int64_t sum = static_cast<std::int64_t>(base_at_) + between_ms(base_stamp_, stamp);
  return sum < 0 ? 0 : static_cast<Ms>(sum);
}

StampClock::Ms StampClock::drift(Ms at) const {
  return at > base_at_ ? (at - base_at_) * kDriftPerMillion / 1'000'000 : 0;
}

StampClock::Ms StampClock::doubt(std::uint32_t stamp) const {
  const std::int64_t ahead = between_ms(base_stamp_, stamp);
  const auto apart = static_cast<Ms>(ahead < 0 ? -ahead : ahead);
  return 2 * kStampMs + apart * kDriftPerMillion / 1'000'000;
}

}  // namespace swarmtalk::frame
