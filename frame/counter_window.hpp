// CounterWindow: which frames of one session have been heard, by their counters.
#pragma once

#include <cstdint>

namespace swarmtalk::frame {

class CounterWindow {
 public:
  static constexpr std::uint32_t kFrames = 64;  // how far back a late frame is told from a replay

  /// Of this frame alone it is known that it was heard.
  static CounterWindow with(std::uint32_t counter) { return {counter, 1}; }
  /// This frame is about to be heard, and none from before it is taken.
  static CounterWindow from(std::uint32_t counter) { return {counter, ~std::uint64_t{1}}; }

  /// Whether a frame was heard, or is too far behind to tell.
  bool was_heard(std::uint32_t counter) const {
    if (counter > newest_) return false;
    const std::uint32_t behind = newest_ - counter;
    return behind >= kFrames || (seen_ >> behind & 1) != 0;
  }

  /// REQUIRES !was_heard(counter)
  void remember(std::uint32_t counter) {
    if (counter > newest_) {
      const std::uint32_t step = counter - newest_;
      seen_ = step < kFrames ? seen_ << step : 0;
      newest_ = counter;
    }
    seen_ |= std::uint64_t{1} << (newest_ - counter);
  }

 private:
  CounterWindow(std::uint32_t newest, std::uint64_t seen) : newest_(newest), seen_(seen) {}

  std::uint32_t newest_;
  std::uint64_t seen_;  // bit n: newest - n
};

}  // namespace swarmtalk::frame
