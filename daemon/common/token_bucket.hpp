// TokenBucket: how often something may be done, a program's messages or those on a reserved
// channel. Reads no clock.
#pragma once

#include <algorithm>
#include <cstdint>

namespace swarmtalk::daemon {

class TokenBucket {
 public:
  /// @param rate_hz  tokens per second; 0: no limit
  /// @param burst    tokens that may be taken at once after a pause, at least 1
  TokenBucket(std::uint32_t rate_hz, std::uint32_t burst)
      : interval_ns_(rate_hz == 0 ? 0 : 1'000'000'000 / rate_hz),
        allowance_ns_(interval_ns_ * std::max<std::uint32_t>(burst, 1)) {}

  bool has_limit() const { return interval_ns_ != 0; }

  /// Takes tokens, all or none. @param now_ns  monotonic
  /// @return false: so many are not left
  bool take(std::uint64_t now_ns, std::uint32_t count = 1) {
    if (interval_ns_ == 0) return true;
    const std::uint64_t taken_ns = interval_ns_ * count;
    const std::uint64_t from_ns = std::max(empty_until_ns_, now_ns);
    if (from_ns + taken_ns > now_ns + allowance_ns_) return false;
    empty_until_ns_ = from_ns + taken_ns;
    return true;
  }

 private:
  std::uint64_t interval_ns_;
  std::uint64_t allowance_ns_;
  std::uint64_t empty_until_ns_ = 0;  // when all that was taken has come back
};

}  // namespace swarmtalk::daemon
