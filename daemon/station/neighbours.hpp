// Neighbours: the robots heard on one link lately, from the headers of all their frames, empty ones
// included. Owned by a station, on the daemon's thread. Reads no clock: the caller passes the time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "daemon/common/followed_count.hpp"
#include "daemon/pose/ranging.hpp"
#include "drivers/link/link.hpp"
#include "drivers/link/own_echoes.hpp"

namespace swarmtalk::daemon {

struct Neighbour {
  using Time = std::chrono::steady_clock::time_point;

  std::uint16_t node = 0;
  std::uint32_t epoch = 0;
  std::uint64_t hardware = 0;  // address that it was heard from last; 0: not known
  Time first_heard{};
  Time last_heard{};
  Range range = Range::unknown();        // when it was heard last
  bool is_out_of_range = false;          // of the link's virtual range, then
  std::optional<frame::FramePose> pose;  // the last it sent, possibly stale
  std::uint64_t frames = 0;              // heard
  std::uint64_t frames_lost = 0;         // gaps in its count of frames, as far as they are believed
  bool is_ghost = false;                 // simulated, by its own word
  bool is_duplicate = false;             // another robot with the same id is heard as well
  bool has_our_hardware = false;         // it has been heard from our interface's own address

  /// Share of its frames that did not come in the last 5 to 10 s in which it was heard: 0 to 1.
  double loss() const;
  /// Frames heard and lost of which that is the share.
  std::uint32_t loss_frames() const;

 private:
  friend class Neighbours;
  FollowedCount count_;
  Time window_began_{};
  std::uint32_t window_heard_ = 0, window_lost_ = 0;      // in this window
  std::uint32_t previous_heard_ = 0, previous_lost_ = 0;  // in the one before
};

class Neighbours {
 public:
  using Time = Neighbour::Time;

  static constexpr std::size_t kMost = 256;
  static constexpr auto kForgetAfter = std::chrono::seconds(10);

  /// From one address, for so long after a robot has restarted, frames may be of before.
  static constexpr auto kLongestHeld = drivers::OwnEchoes::kLongestHeld;

  /// Two robots with one id. The older one is heard again after the younger began, so neither is
  /// the other, restarted.
  struct Duplicate {
    const Neighbour* older = nullptr;  // null: there is none
    const Neighbour* younger = nullptr;
    const Neighbour* double_of_us = nullptr;  // a robot with our interface's address
  };

  /// One more frame. @return what it reveals, once for each pair; valid until the next call
  Duplicate heard(const drivers::FrameReception& frame, const Range& range, bool is_out_of_range);

  /// Those heard within kForgetAfter, by node id; a robot that has restarted once, as it is now.
  std::vector<Neighbour> list(Time now) const;

  /// Robots that made place for others because more than kMost were heard.
  std::uint64_t evicted() const { return evicted_; }

 private:
  Neighbour& entry(const drivers::FrameReception& frame);
  Duplicate find_duplicate(Neighbour& neighbour);
  bool has_restarted(const Neighbour& neighbour) const;
  static void count(Neighbour& neighbour, std::uint32_t counter, Time now);

  std::vector<std::uint64_t> keys_;  // node and epoch of entries_: searched for every frame
  std::vector<Neighbour> entries_;
  std::uint64_t evicted_ = 0;
};

}  // namespace swarmtalk::daemon
