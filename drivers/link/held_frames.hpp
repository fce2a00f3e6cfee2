// HeldFrames: sealed frames of robots that have not shown yet that they live (frame/freshness.hpp).
// They are kept as they came until their robot has, so that what it says first is not lost. One for
// each link, on the link's thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/link/link.hpp"
#include "frame/freshness.hpp"

namespace swarmtalk::drivers {

class HeldFrames {
 public:
  static constexpr std::size_t kMost = 512;
  static constexpr std::size_t kMostBytes = 384 * 1024;
  static constexpr std::size_t kMostOfOne = 64;
  /// Nothing is taken that may be older.
  static constexpr std::chrono::milliseconds kLongest{frame::Freshness::kBoundMs};

  struct Held {
    frame::Freshness::Voice voice{};
    std::uint32_t counter = 0;
    FrameArrival arrival;
    std::vector<std::uint8_t> bytes;
  };

  bool is_empty() const { return size_ == 0; }
  std::size_t size() const { return size_; }
  std::size_t bytes() const { return bytes_; }

  /// Keeps a frame, unless it is here already. Where there is no room, the oldest frame of whoever
  /// has most here goes: recorded frames of many robots leave each of the living its part.
  void keep(Held frame);

  /// Takes out all frames of a voice, in the order in which they were sent.
  std::vector<Held> take(const frame::Freshness::Voice& voice);

 private:
  struct Owner {
    frame::Freshness::Voice voice{};
    std::vector<Held> frames;  // as they came, at most kMostOfOne
  };

  void drop_before(MonotonicTime time);
  void drop_oldest(Owner& owner);
  void drop_of_most();

  std::vector<Owner> owners_;  // of a frame at least
  std::size_t size_ = 0;
  std::size_t bytes_ = 0;
};

}  // namespace swarmtalk::drivers
