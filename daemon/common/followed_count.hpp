// FollowedCount: a count that a robot raises by one with each thing it sends: where it stands, how
// fast it goes, and how much of what it passes over can have been missed. Anybody can make up
// numbers on a link without key, so what is passed over is believed only as far as the robot can
// have sent so much at the pace at which it was heard. Used by the hub for messages and by stations
// for frames, on the daemon's thread. Reads no clock.
#pragma once

#include <cstdint>

namespace swarmtalk::daemon {

class FollowedCount {
 public:
  /// In all, so many are believed to be missing, and what the robot can have sent since it was
  /// heard at twice the highest rate that was measured. What comes slowly is believed again.
  static constexpr std::uint32_t kBelieved = 16;
  static constexpr double kBelievedTimesRate = 2.0;
  /// A rate is measured over this time at least; what a robot can have sent in it is believed even
  /// if less has passed.
  static constexpr std::uint64_t kPaceNs = 100'000'000;
  /// Of a rate, at most so many numbers for each that was heard: made up ones raise it no further.
  static constexpr std::uint32_t kMostSteps = 8;

  /// A count that passes over so many is followed at once, believed or not. One that passes over
  /// more, without being believed, is followed if it goes on there for kElsewhereNs, and nothing
  /// comes where it was; one that falls back farther, after kBackNs.
  static constexpr std::uint32_t kFollowed = 256;
  static constexpr std::uint64_t kElsewhereNs = 1'000'000'000;
  static constexpr std::uint64_t kBackNs = 10'000'000'000;

  enum class Place : std::uint8_t {
    kAhead,      // the highest so far
    kBehind,     // it was overtaken, or comes again
    kElsewhere,  // the count goes on from here; what was missing before is not known any more
    kBack,       // the first that is heard, and below what was told: the count goes on from here
    kDoubted,    // far from where the count was, and not followed
  };
  struct Step {
    Place place = Place::kDoubted;
    std::uint32_t distance = 0;  // kAhead, kElsewhere: from the highest before, kElsewhere 0: back.
                                 // kBehind, kBack: to the highest before
    std::uint32_t believed = 0;  // how many of those passed over can have been missed
  };

  FollowedCount() = default;
  /// @param is_heard  else it was only told of, and the first that is heard may be elsewhere
  FollowedCount(std::uint32_t number, std::uint64_t now_ns, bool is_heard)
      : highest_(number), heard_(number), heard_ns_(now_ns), used_ns_(now_ns), is_heard_(is_heard) {
    pace_.begin_ns = now_ns;
  }

  /// One more was heard. @param explained  believed besides: what the receiver itself has dropped
  /// @param now_ns  any clock that does not go back; older times are taken for the newest
  Step heard(std::uint32_t number, std::uint64_t explained, std::uint64_t now_ns);

  /// The robot is said to have sent all up to this number. @return kAhead, and `believed` is the
  /// distance, this number included; kBehind; or kDoubted, and nothing has changed
  Step told(std::uint32_t number, std::uint64_t now_ns);

  /// Some that were passed over and not believed: how many are meanwhile. They count as believed.
  std::uint32_t believe_now(std::uint32_t doubted);

  /// One that was believed to be missing came after all.
  void came_late();

 private:
  /// How fast numbers go up, in one while.
  struct Pace {
    std::uint64_t begin_ns = 0;
    std::uint32_t heard = 0;
    std::uint32_t advanced = 0;

    double hz(std::uint64_t now_ns) const;
  };
  /// Where it may go on: the last number there that was heard.
  struct Elsewhere {
    std::uint32_t number = 0;
    Pace pace;  // heard 0: nowhere
  };

  double hz(std::uint64_t now_ns) const;
  double believable(std::uint64_t now_ns) const;
  void go_to(std::uint32_t number, std::uint64_t taken, std::uint64_t now_ns);
  Step doubt(std::uint32_t number, std::uint64_t explained, std::uint64_t now_ns);
  Step begin_at(std::uint32_t number, std::uint64_t now_ns);

  std::uint32_t highest_ = 0;  // heard or told of
  std::uint32_t heard_ = 0;    // highest that was heard, and when
  std::uint64_t heard_ns_ = 0;
  double most_hz_ = 0;
  double used_ = 0;  // what was believed and has not been sent since, and up to when
  std::uint64_t used_ns_ = 0;
  Pace pace_;
  Elsewhere elsewhere_;
  bool is_heard_ = false;
};

}  // namespace swarmtalk::daemon
