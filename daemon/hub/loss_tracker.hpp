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

  /// A beacon is believed if the source can have sent as many since its last message: at twice the
  /// highest rate that was measured, and a few more. Anybody can make beacons on a link without
  /// key.
  static constexpr std::uint32_t kBelieved = 16;
  static constexpr double kBelievedTimesRate = 2.0;

  /// @param max_sources  at least 1
  explicit LossTracker(std::size_t max_sources) : max_sources_(max_sources) {}

  /// A message has come. @param number  of its sender, channel and epoch, counting by one
  /// @param drops  of all stations, when this message came
  /// @param now_ns  when that was; any clock that does not go back
  /// @return what was lost since the source's message before. A gap is put down to the kernel, then
  ///   to the node's memory, as far as either dropped something meanwhile that no other gap has
  ///   been put down to; the rest to the air. The first message of a source finds nothing
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
  /// What beacons told that was not believed.
  std::uint64_t disbelieved() const { return disbelieved_; }

 private:
  /// How fast a source counts, from its messages alone.
  struct Pace {
    bool has_heard = false;
    std::uint32_t heard = 0;  // highest number of a message, and when it came
    std::uint64_t heard_ns = 0;
    std::uint32_t begin = 0;  // of the time that is being measured
    std::uint64_t begin_ns = 0;
    double most_hz = 0;

    void note(std::uint32_t number, std::uint64_t now_ns);
    bool believes(std::uint32_t number, std::uint64_t now_ns) const;
  };
  struct Entry {
    Source source;
    std::uint32_t highest = 0;
    bool is_highest_missing = false;  // a beacon told of it, it did not come
    std::bitset<kWindow> missing;     // bit i: number highest - 1 - i was counted as lost
    DropTotals drops;                 // at the message before
    Pace pace;
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
  std::uint64_t disbelieved_ = 0;
};

}  // namespace swarmtalk::daemon
