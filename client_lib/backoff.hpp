// Backoff: how long to wait before the next attempt: doubled each time, and shortened at random,
// because many clients of one daemon must not return in step.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <random>

#include "loop/chance.hpp"

namespace swarmtalk::client {

class Backoff {
 public:
  Backoff(std::chrono::milliseconds first, std::chrono::milliseconds longest)
      : first_(first), longest_(longest), present_(first), jitter_(loop::random_bits()) {}

  /// Half to all of the present wait; the next one is twice as long, up to the longest.
  std::chrono::microseconds next() {
    std::uniform_int_distribution<std::int64_t> spread(present_.count() * 500,
                                                       present_.count() * 1000);
    const std::chrono::microseconds wait(spread(jitter_));
    present_ = std::min(longest_, present_ * 2);
    return wait;
  }
  /// After a success.
  void reset() { present_ = first_; }
  /// There is no use in trying soon.
  void be_longest() { present_ = longest_; }

 private:
  std::chrono::milliseconds first_;
  std::chrono::milliseconds longest_;
  std::chrono::milliseconds present_;
  std::minstd_rand jitter_;
};

}  // namespace swarmtalk::client
