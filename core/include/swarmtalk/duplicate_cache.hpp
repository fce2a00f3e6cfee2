// The messages a node has met lately: which of their packets it has forwarded, whether it has
// delivered them, and when. One record per message, found by (node, message, channel, epoch).
// Owned by the node; the reassembler keeps its own part of a message under the same index.
//
// A record is *open* while its message is being put together and *closed* afterwards; only a closed
// one is given away when room is short. Closed records of one-hop messages matter for a moment only
// (a link may repeat a packet), those of flooded messages for as long as copies may wander. Small
// message numbers come back, so a flooded message's record also goes when its number is due again.
#pragma once

#include <stdint.h>

#include "swarmtalk/record_index.hpp"
#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class DuplicateCache {
 public:
  using W = Wire<P>;
  using Header = typename W::Header;
  using Mask = typename W::PacketMask;
  using PacketIndex = typename W::PacketIndex;
  using MessageNumber = typename W::MessageNumber;
  using Ticks = UintFor<P::kClockBits>;
  using Stamp = UintFor<P::kStampBits>;
  using Index = UintFor<bits_for(P::kRecords)>;
  static constexpr Index kNone = P::kRecords;
  static_assert(P::kStampBits + P::kClosedShift <= P::kClockBits, "stamps are cut from the clock");

  /// A time as stamps hold it: in ticks, and in steps of 2^kClosedShift ticks.
  struct Moment {
    Stamp tick;
    Stamp step;
    explicit Moment(Ticks now)
        : tick(static_cast<Stamp>(now)), step(static_cast<Stamp>(now >> P::kClosedShift)) {}
  };

  DuplicateCache() : used_(0), sweep_(0), oldest_(0) {}

  /// Record of the header's message. @return kNone if it is not remembered (any more); an open one
  /// is found even past its time (see is_stale), because somebody holds packets of it
  SWARMTALK_HOT Index find(const Header& header, Moment now) const {
    const RecordKey<P> key(header);
    const Index index = index_.find(records_, used_, key);
    if (index == kNone || (records_[index].flags & kOpen) != 0) return index;
    return is_expired(records_[index], now) ? kNone : index;
  }

  /// Whether an open message has waited too long: a packet that comes now is of a later message
  /// with the same number. REQUIRES is_open(i).
  bool is_stale(Index i, Moment now) const { return is_expired(records_[i], now); }

  /// Begins a record for the header's message, closed, nothing forwarded or delivered; looks at the
  /// sender's other messages on the channel on the way (see note). REQUIRES find() found none.
  /// @param flood   copies may come by other ways, for long
  /// @param insist  take a younger flooded message's record if there is nothing better
  /// @return kNone if all records are open, or too precious when not insisting
  SWARMTALK_HOT Index insert(const Header& header, bool flood, bool insist, Moment now) {
    const RecordKey<P> key(header);
    Choice choice = {kNone, 0};
    for (Index i = index_.first(key); index_.is_valid(i, used_); i = index_.next(records_, i)) {
      Record* const record = in_register(&records_[i]);
      if (P::kMessageBits < 16 && record->key.is_same_stream(key)) note(*record, key, now);
      consider(i, *record, insist, kScans, now, choice);
    }
    Index index = choice.index;
    if (choice.score != kExpiredScore && used_ < P::kRecords) {
      index = used_++;
      records_[index].key = key;
      index_.link(records_, index);
    } else if (choice.score != kExpiredScore && !kScans) {
      index = cheapest(insist, now);
      if (index == kNone) return kNone;
      index_.unlink(records_, index);
      records_[index].key = key;
      index_.link(records_, index);
    }
    if (index == kNone) return kNone;
    records_[index].key = key;  // an expired one of the chain stays in it
    renew(index, flood, now);
    return index;
  }

  /// Makes a record that is there new: nothing forwarded or delivered.
  void renew(Index i, bool flood, Moment now) {
    Record& record = records_[i];
    record.forwarded = 0;
    record.flags = flood ? kFlood : 0;
    record.stamp = stamp_of(record.flags, now);
  }

  /// What is known of an open message's chance to become whole.
  enum class Chance : uint8_t {
    kNotOpen,
    kAny,         // its packets may come by other ways: a gap may still be filled
    kWithoutGap,  // one hop, so in order: a gap is a loss
    kNone,        // its sender was heard beginning another message on the channel since
  };
  Chance chance(Index i) const {
    const uint8_t flags = records_[i].flags;
    return (flags & kOpen) == 0        ? Chance::kNotOpen
           : (flags & kFlood) != 0     ? Chance::kAny
           : (flags & kOvertaken) != 0 ? Chance::kNone
                                       : Chance::kWithoutGap;
  }
  bool is_open(Index i) const { return i < used_ && (records_[i].flags & kOpen) != 0; }
  bool is_delivered(Index i) const { return (records_[i].flags & kDelivered) != 0; }
  bool is_given_up(Index i) const { return (records_[i].flags & kGivenUp) != 0; }
  bool is_forwarded(Index i, PacketIndex sequence) const {
    return (records_[i].forwarded & bit(sequence)) != 0;
  }
  void set_forwarded(Index i, PacketIndex sequence) {
    records_[i].forwarded = static_cast<Mask>(records_[i].forwarded | bit(sequence));
  }

  /// The message is being put together; `now` is when its last packet came.
  void open(Index i, Moment now) {
    records_[i].flags = static_cast<uint8_t>(records_[i].flags | kOpen);
    records_[i].stamp = now.tick;
  }
  /// Ticks since the last packet of an open message.
  Ticks since_last_packet(Index i, Moment now) const { return age(records_[i], now); }
  void close_delivered(Index i, Moment now) { close(i, kDelivered, now); }
  void close_given_up(Index i, Moment now) { close(i, kGivenUp, now); }

  /// Looks at the next few records. @return an open one past its time, now closed as given up
  /// (its fragments are the caller's to release), or kNone. Called on every packet, so that every
  /// record is looked at before its stamp wraps.
  Index sweep(Moment now) {
    for (uint8_t n = 0; n < kSweep && used_ != 0; ++n) {
      advance(sweep_);
      Record& record = records_[sweep_];
      if (!is_expired(record, now)) continue;
      if ((record.flags & kOpen) != 0) {
        close(sweep_, kGivenUp, now);
        return sweep_;
      }
      record.flags = kExpired;
    }
    return kNone;
  }

  /// Whether any record of the last minutes is of node `node`: an id to avoid.
  bool knows_node(typename W::NodeId node) const {
    for (Index i = 0; i < used_; ++i) {
      if (records_[i].key.node() == node && (records_[i].flags & kExpired) == 0) return true;
    }
    return false;
  }

  Index used() const { return used_; }

 private:
  enum : uint8_t {
    kOpen = 1,
    kDelivered = 2,
    kGivenUp = 4,  // lost a packet for want of memory or time: not to be begun again
    kFlood = 8,
    kExpired = 16,
    kOvertaken = 32,
  };
  struct Record : RecordLink<P> {
    RecordKey<P> key;
    Mask forwarded;
    Stamp stamp;  // tick of the last packet; of a closed flooded message in 2^kClosedShift ticks
    uint8_t flags;
  };
  static constexpr MessageNumber kQuarter = (W::kMessageMask >> 2) + MessageNumber{1};
  /// Records looked at per packet for their age: a table with narrow stamps has to be through
  /// before a stamp wraps.
  static constexpr uint8_t kSweep = P::kStampBits == 8 ? 3 : 1;
  /// Without buckets every new message looks at every record anyway.
  static constexpr bool kScans = P::kBuckets == 0;
  /// Records of a large table that are compared to find one to give away.
  static constexpr uint8_t kCompared = 8;

  /// How willingly a record is given away: expired ones first, then one-hop ones by age, then
  /// flooded ones by age. An age is below half of a stamp's range, so its top bit is free.
  using Score = Stamp;
  static constexpr Score kOneHopScore = static_cast<Score>(Score{1} << (P::kStampBits - 1));
  static constexpr Score kExpiredScore = static_cast<Score>(~Score{0});
  static constexpr Stamp kSurely = static_cast<Stamp>(P::kFloodSurelyTicks >> P::kClosedShift);
  struct Choice {
    Index index;
    Score score;
  };

  static Mask bit(PacketIndex sequence) {
    return static_cast<Mask>(static_cast<Mask>(1) << sequence);
  }
  static SWARMTALK_INLINE Stamp stamp_of(uint8_t flags, Moment now) {
    return (flags & (kFlood | kOpen)) == kFlood ? now.step : now.tick;
  }
  static SWARMTALK_INLINE Stamp age(const Record& record, Moment now) {
    return static_cast<Stamp>(stamp_of(record.flags, now) - record.stamp);
  }
  static SWARMTALK_INLINE Stamp limit_of(uint8_t flags) {
    return static_cast<Stamp>((flags & kOpen) != 0    ? P::kAssemblyTicks
                              : (flags & kFlood) != 0 ? P::kFloodTicks >> P::kClosedShift
                                                      : P::kOneHopDuplicateTicks);
  }
  static SWARMTALK_INLINE bool is_expired(const Record& record, Moment now) {
    return (record.flags & kExpired) != 0 || age(record, now) > limit_of(record.flags);
  }
  void close(Index i, uint8_t how, Moment now) {
    records_[i].flags = static_cast<uint8_t>((records_[i].flags & ~kOpen) | how);
    records_[i].stamp = stamp_of(records_[i].flags, now);
  }
  void advance(Index& i) const {
    ++i;
    if (i >= used_) i = 0;
  }

  /// A new message of this record's sender and channel has begun. If the record is of a one-hop
  /// message that is still open, that one has lost a packet. If it is of a flooded message and
  /// older than kFloodSurelyTicks, its number may be due again: it goes if it is in the middle half
  /// of the number space ahead. (Nearer ones are the sender's last, or, if this one came late, its
  /// next.)
  SWARMTALK_INLINE void note(Record& record, const RecordKey<P>& key, Moment now) {
    if ((record.flags & kOpen) != 0) {
      record.flags = static_cast<uint8_t>(record.flags | kOvertaken);
      return;
    }
    const MessageNumber ahead =
        static_cast<MessageNumber>((record.key.message() - key.message()) & W::kMessageMask);
    if (static_cast<MessageNumber>(ahead - kQuarter) < 2 * kQuarter &&
        (record.flags & kFlood) != 0 && age(record, now) > kSurely) {
      record.flags = kExpired;
    }
  }

  /// @param with_living  also compare records that are not expired
  static SWARMTALK_INLINE void consider(Index i, const Record& record, bool insist,
                                        bool with_living, Moment now, Choice& choice) {
    const uint8_t flags = record.flags;
    if ((flags & kOpen) != 0) return;
    Score score = kExpiredScore;
    const Stamp its_age = age(record, now);
    if ((flags & kExpired) == 0 && its_age <= limit_of(flags)) {
      if (!with_living) return;
      score = static_cast<Score>(its_age + 1u);
      if ((flags & kFlood) == 0) {
        score = static_cast<Score>(score | kOneHopScore);
      } else if (!insist && its_age <= kSurely) {
        return;
      }
    }
    if (score > choice.score) {
      choice.index = i;
      choice.score = score;
    }
  }

  /// The best of the next few of a large table.
  Index cheapest(bool insist, Moment now) {
    Choice choice = {kNone, 0};
    for (uint8_t n = 0; n < kCompared && choice.score != kExpiredScore; ++n) {
      advance(oldest_);
      consider(oldest_, records_[oldest_], insist, true, now, choice);
    }
    if (choice.index != kNone) oldest_ = choice.index;
    return choice.index;
  }

  Record records_[P::kRecords];
  RecordIndex<P, (P::kBuckets == 0)> index_;
  Index used_;    // records 0..used_-1 have been used
  Index sweep_;   // the record looked at last for its age
  Index oldest_;  // the record given away last: those after it are the oldest, roughly
};

}  // namespace core
}  // namespace swarmtalk
