#include "daemon/answer/air_budget.hpp"

#include <algorithm>
#include <iterator>

namespace swarmtalk::daemon {
namespace {

constexpr std::uint32_t kFrameUs = 127;     // preamble, DIFS, mean backoff
constexpr std::uint32_t kAroundBytes = 80;  // 802.11, LLC and FCS; air frame, pose, packet
constexpr std::uint32_t kTypicalBytes = 120;

}  // namespace

std::uint32_t AirBudget::air_us(std::size_t message_bytes) {
  return kFrameUs + static_cast<std::uint32_t>((message_bytes + kAroundBytes) * 8 / 6);
}

void AirBudget::heard(std::uint16_t sender, std::uint32_t air_us, std::uint32_t told_us, Time now) {
  use(air_us, now);
  if (!reporters_.contains(sender) && reporters_.size() >= kMostReporters) {
    forget_old(now);
    if (reporters_.size() >= kMostReporters) return;
  }
  reporters_[sender] = {air_us, told_us, now};
}

void AirBudget::sent(std::uint32_t air_us, Time now) {
  use(air_us, now);
  own_us_ = air_us;
}

void AirBudget::forget_old(Time now) {
  std::erase_if(reporters_,
                [&](const auto& entry) { return now - entry.second.at > kForgetAfter; });
}

std::uint32_t AirBudget::round_us(std::size_t neighbours, Time now) {
  forget_old(now);
  const std::uint32_t own = own_us_ != 0 ? own_us_ : air_us(kTypicalBytes);
  std::uint32_t round = own;
  for (const auto& [node, reporter] : reporters_) round += reporter.air_us;
  if (neighbours > reporters_.size()) {
    round += own * static_cast<std::uint32_t>(neighbours - reporters_.size());
  }
  return round;
}

AirBudget::Duration AirBudget::period(std::size_t neighbours, Time now) {
  std::uint64_t most = round_us(neighbours, now);
  for (const auto& [node, reporter] : reporters_) {
    most = std::max<std::uint64_t>(most, reporter.told_us);
  }
  return std::max<Duration>(Duration(most * kShareDivisor), kLeastPeriod);
}

bool AirBudget::has_room(std::uint32_t air_us, Time now) {
  use(0, now);
  return saved_us_ >= static_cast<std::int64_t>(air_us);
}

// What is not used is saved, up to a little; what others use beyond it is a debt, up to as much.
void AirBudget::use(std::uint32_t air_us, Time now) {
  if (saved_at_ != Time{}) {
    const auto passed = std::chrono::duration_cast<Duration>(now - saved_at_).count();
    saved_us_ += std::max<std::int64_t>(passed, 0) / static_cast<std::int64_t>(kShareDivisor);
  }
  saved_at_ = now;
  saved_us_ =
      std::clamp(saved_us_, -kMostSavedUs, kMostSavedUs) - static_cast<std::int64_t>(air_us);
  saved_us_ = std::max(saved_us_, -kMostSavedUs);
}

}  // namespace swarmtalk::daemon
