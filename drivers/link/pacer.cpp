#include "drivers/link/pacer.hpp"

#include <algorithm>
#include <stdexcept>

namespace swarmtalk::drivers {

using namespace std::chrono_literals;

Pacer::Pacer(const PacerConfig& config, std::uint64_t seed)
    : max_jitter_(config.max_jitter),
      max_forward_jitter_(config.max_forward_jitter.value_or(0us)),
      is_suiting_(!config.max_forward_jitter),
      random_(seed) {
  if (!(config.rate_limit_hz >= 0.0 && config.rate_limit_hz <= 1e9)) {
    throw std::runtime_error("rate limit must be 0 (unlimited) to 1e9 frames per second");
  }
  if (config.burst_frames == 0) throw std::runtime_error("burst must be at least 1 frame");
  for (const auto jitter : {config.max_jitter, config.max_forward_jitter.value_or(0us)}) {
    if (jitter < 0us || jitter > 10s) throw std::runtime_error("jitter must be 0 to 10 seconds");
  }
  if (config.rate_limit_hz > 0.0) {
    // Below one frame in a day the sum of allowances would overflow; nobody means such a rate.
    const double seconds = std::min(1.0 / config.rate_limit_hz, 86400.0);
    interval_ = std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
    burst_allowance_ = interval_ * std::min<std::uint32_t>(config.burst_frames - 1, 65535);
  }
}

Pacer::Duration Pacer::wait(Time now, bool is_forward) {
  if (is_slot_of_forward_ && !is_forward) {
    slot_.reset();
    is_slot_of_forward_ = false;
  }
  const Duration jitter = is_forward ? longest_forward_jitter() : max_jitter_;
  if (interval_ == 0ns && jitter == 0ns) return 0ns;
  if (!slot_) {
    slot_ = now;
    if (full_at_) slot_ = std::max(now, *full_at_ - burst_allowance_);
    if (jitter > 0ns) {
      *slot_ += Duration(std::uniform_int_distribution<Duration::rep>(0, jitter.count())(random_));
    }
    is_slot_of_forward_ = is_forward;
  }
  return std::max(Duration(0), *slot_ - now);
}

void Pacer::sent(Time now) {
  slot_.reset();
  is_slot_of_forward_ = false;
  if (interval_ == 0ns) return;
  full_at_ = (full_at_ ? std::max(now, *full_at_) : now) + interval_;
}

}  // namespace swarmtalk::drivers
