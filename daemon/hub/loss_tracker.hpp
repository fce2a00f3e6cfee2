// LossTracker: finds lost messages as gaps in the numbers of each sender's channel, and says where
// they were probably lost. Used by the hub, for messages that a local program subscribes to. It
// remembers a limited number of senders, the longest unheard goes first, and reads no clock.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <list>
#include <unordered_map>

#include "daemon/common/followed_count.hpp"
#include "daemon/message/loss.hpp"

namespace swarmtalk::daemon {

class LossTracker {
 public:
  /// One run of one sender on one channel. Its messages have the same numbers on all links, so one
  /// that came over any of them is not lost.
  struct Source {
    std::uint16_t channel = 0;
    std::uint16_t sender = 0;
    std::uint32_t epoch = 0;
    bool operator==(const Source&) const = default;
  };

  /// Numbers this far below the highest are still recognised when they come late.
  static constexpr std::size_t kWindow = FollowedCount::kFollowed;
  static constexpr std::uint32_t kBelieved = FollowedCount::kBelieved;
  /// @param max_sources  at least 1
  explicit LossTracker(std::size_t max_sources) : max_sources_(max_sources) {}

  /// A message has come. @param number  of its sender, channel and epoch, counting by one
  /// @param drops  of all stations, when this message came
  /// @param now_ns  when that was; any clock that does not go back
  /// @return what was lost since the source's message before. A gap is put down to the kernel, then
  ///   to the node's memory, as far as either dropped something meanwhile that no other gap has
  ///   been put down to; the rest to the air. The first message of a source finds nothing. What is
  ///   not believed (FollowedCount) is reported once the source has been heard enough, or never
  Loss note(const Source& source, std::uint32_t number, const DropTotals& drops,
            std::uint64_t now_ns);

  /// A beacon has come: the source has sent messages up to this number. @return what is missing, as
  /// for note(), this number included. The first beacon of a source finds nothing, and so does one
  /// that is not believed
  Loss note_last(const Source& source, std::uint32_t number, const DropTotals& drops,
                 std::uint64_t now_ns);

  /// Nobody subscribes to the channel any more: what is missed from now on is not a loss.
  void forget(std::uint16_t channel);

  std::size_t size() const { return sources_.size(); }
  /// Sources forgotten for want of room.
  std::uint64_t evicted() const { return evicted_; }
  /// Beacons that were not believed.
  std::uint64_t disbelieved() const { return disbelieved_; }
  /// Messages whose numbers told of more missing ones than were believed.
  std::uint64_t doubted() const { return doubted_; }

 private:
  struct Entry {
    Source source;
    FollowedCount count;
    DropTotals drops;                 // at the message before
    bool is_highest_missing = false;  // a beacon told of it, it did not come
    bool has_missing = false;         // some bit of `missing` may be set
    bool has_doubted = false;         // some bit of `doubted` is set
    std::bitset<kWindow> missing;     // bit i: the highest number - 1 - i was counted as lost
    std::bitset<kWindow> doubted;     // it did not come, but that was not believed
  };
  struct Hash {
    std::size_t operator()(const Source& source) const {
      const std::uint64_t bits =
          std::uint64_t{source.sender} << 48 | std::uint64_t{source.channel} << 32 | source.epoch;
      return static_cast<std::size_t>(bits * 0x9E3779B97F4A7C15u >> 17);
    }
  };
  using Entries = std::list<Entry>;  // the last heard in front

  Entry* find(const Source& source);
  void follow(const Source& source, const DropTotals& drops, const FollowedCount& count);
  std::uint64_t unexplained(const Entry& entry, const DropTotals& drops) const;
  static void advance(Entry& entry, std::uint32_t ahead, std::uint32_t believed);
  static bool take_back(Entry& entry, std::uint32_t behind);
  static std::uint32_t go_back(Entry& entry, std::uint32_t behind);
  static std::uint32_t believe_now(Entry& entry);
  Loss locate(const Entry& entry, std::uint64_t gap, const DropTotals& drops);

  std::size_t max_sources_;
  Entries entries_;
  std::unordered_map<Source, Entries::iterator, Hash> sources_;
  DropTotals explained_;  // drops that a gap was put down to
  std::uint64_t evicted_ = 0;
  std::uint64_t disbelieved_ = 0;
  std::uint64_t doubted_ = 0;
};

}  // namespace swarmtalk::daemon
