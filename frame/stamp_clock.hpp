// StampClock: when a session's frames can have been sent at the earliest, by the stamps in them and
// by the nonces of ours that some have brought back. Times are milliseconds of our monotonic clock.
#pragma once

#include <cstdint>

namespace swarmtalk::frame {

class StampClock {
 public:
  using Ms = std::uint64_t;

  static constexpr Ms kStampMs = 10;
  static constexpr std::uint32_t kMask = 0xFFFFFF;        // of a stamp
  static constexpr std::uint32_t kDriftPerMillion = 200;  // of two clocks against each other

  /// A frame with this stamp was made after `drawn_at`.
  StampClock(std::uint32_t stamp, Ms drawn_at) : base_at_(drawn_at), base_stamp_(stamp) {}

  /// And so was another, which came at `at`. The latest of what is known holds, unless their clock
  /// has stood still meanwhile.
  void prove(std::uint32_t stamp, Ms drawn_at, Ms at);

  /// The earliest time at which a frame with this stamp was made, but for the clocks' drift.
  Ms sent_at(std::uint32_t stamp) const;

  /// What drift may make of a time `at` now.
  Ms drift(Ms at) const;
  /// What drift and the steps of stamps may make of sent_at(stamp).
  Ms doubt(std::uint32_t stamp) const;

 private:
  Ms base_at_;
  std::uint32_t base_stamp_;
};

}  // namespace swarmtalk::frame
