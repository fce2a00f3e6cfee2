// LossTracker: finds lost messages as gaps in the numbers of each sender's channel, and says where
// they were probably lost. Used by the hub, for messages that a local program subscribes to. It
// remembers a limited number of senders, the longest unheard goes first, and reads no clock.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <list>
#include <unordered_map>

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
  static constexpr std::size_t kWindow = 256;
  /// A longer gap is not a loss but another count: the sender is followed from there.
  static constexpr std::uint32_t kLongestGap = UINT32_C(1) << 24;

  /// @param max_sources  at least 1
  explicit LossTracker(std::size_t max_sources) : max_sources_(max_sources) {}

  /// A message has come. @param number  of its sender, channel and epoch, counting by one
  /// @param drops  of all stations, when this message came
  /// @return what was lost since the source's message before. A gap is put down to the kernel, then
  ///   to the node's memory, as far as either dropped something meanwhile that no other gap has
  ///   been put down to; the rest to the air. The first message of a source finds nothing
  Loss note(const Source& source, std::uint32_t number, const DropTotals& drops);

  /// A beacon has come: the source has sent messages up to this number. @return what is missing, as
  /// for note(), this number included. The first beacon of a source finds nothing
  Loss note_last(const Source& source, std::uint32_t number, const DropTotals& drops);

  /// Nobody subscribes to the channel any more: what is missed from now on is not a loss.
  void forget(std::uint16_t channel);

  std::size_t size() const { return sources_.size(); }
  /// Sources forgotten for want of room.
  std::uint64_t evicted() const { return evicted_; }

 private:
  struct Entry {
    Source source;
    std::uint32_t highest = 0;
    bool is_highest_missing = false;  // a beacon told of it, it did not come
    std::bitset<kWindow> missing;     // bit i: number highest - 1 - i was counted as lost
    DropTotals drops;                 // at the message before
  };
  struct Hash {
    std::size_t operator()(const Source& source) const {
      const std::uint64_t bits =
          std::uint64_t{source.sender} << 48 | std::uint64_t{source.channel} << 32 | source.epoch;
      return static_cast<std::size_t>(bits * 0x9E3779B97F4A7C15u >> 17);
    }
  };
  using Entries = std::list<Entry>;  // the last heard in front

  Entry* find(const Source& source, std::uint32_t number, const DropTotals& drops);
  static void advance(Entry& entry, std::uint32_t ahead);
  Loss locate(const Entry& entry, std::uint64_t gap, const DropTotals& drops);

  std::size_t max_sources_;
  Entries entries_;
  std::unordered_map<Source, Entries::iterator, Hash> sources_;
  DropTotals explained_;  // drops that a gap was put down to
  std::uint64_t evicted_ = 0;
};

}  // namespace swarmtalk::daemon
