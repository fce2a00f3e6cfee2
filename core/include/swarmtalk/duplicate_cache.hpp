// The messages a node has met lately: which of their packets it has forwarded, whether it has
// delivered them, and when. One record per message, found by (node, message, channel, epoch).
// Owned by the node; the reassembler keeps its own part of a message in the same record.
//
// A record is *open* while its message is being put together and *closed* afterwards; only a closed
// one is given away when room is short. Closed records of one-hop messages matter for a moment only
// (a link may repeat a packet), those of flooded messages for as long as copies may wander. Small
// message numbers come back, so a flooded message's record also goes when its number is due again.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/record_index.hpp"
#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// Which calls look at records for their age: every one, or every eighth at eight times as many.
template <bool kInTurns>
class SweepTurn {
 protected:
  static constexpr uint8_t kTurn = 8;
  bool is_turn() { return --left_ == 0; }
  void next_turn_in(uint8_t calls) { left_ = calls; }

 private:
  uint8_t left_ = kTurn;
};
template <>
class SweepTurn<false> {
 protected:
  static constexpr uint8_t kTurn = 1;
  bool is_turn() { return true; }
  void next_turn_in(uint8_t) {}
};

template <class P>
class DuplicateCache : private RecordIndex<P, (P::kBuckets == 0)>,
                       private SweepTurn<(P::kBuckets > 0)> {
  using Lookup = RecordIndex<P, (P::kBuckets == 0)>;  // a base: without a table it takes no memory
  using Turn = SweepTurn<(P::kBuckets > 0)>;

 public:
  using W = Wire<P>;
  using Key = RecordKey<P>;
  using KeyArgument = typename Key::Argument;
  using Entry = Record<P>;
  using MessageNumber = typename W::MessageNumber;
  using Ticks = UintFor<P::kClockBits>;
  using Stamp = typename Entry::Stamp;
  using Index = UintFor<bits_for(P::kRecords)>;

  DuplicateCache() : Lookup(records_), sweep_(0) {}
  DuplicateCache(const DuplicateCache&) = delete;
  DuplicateCache& operator=(const DuplicateCache&) = delete;

  /// The time of what follows, until the next call.
  void set_now(Ticks now) {
    tick_ = static_cast<Stamp>(now);
    if (P::kClosedShift != 0) step_ = static_cast<Stamp>(now >> P::kClosedShift);
  }

  /// The message's record. @return null if it is not remembered (any more); an open one is found
  /// even past its time (see is_expired), because somebody holds packets of it
  SWARMTALK_HOT_APART Entry* find(KeyArgument key) {
    Entry* const record = Lookup::find(records_, key);
    return record == nullptr || record->is_open() || !is_expired(*record) ? record : nullptr;
  }

  /// Whether a record's time is over. Of an open one: a packet that comes now is of a later message
  /// with the same number.
  SWARMTALK_HOT bool is_expired(const Entry& record) const { return age(record) == kOver; }
  /// Ticks since the last packet of an open message that is not expired.
  Ticks since_last_packet(const Entry& record) const { return age(record); }

  /// Ticks since a stamp that is in ticks: of an open message, or a closed one-hop message.
  Stamp time_since(const Entry& record) const { return static_cast<Stamp>(tick_ - record.stamp); }

  /// Begins a record for a message, closed, nothing forwarded or delivered; looks at the sender's
  /// other messages on the channel on the way (see note). REQUIRES find() found none.
  /// @param flood   copies may come by other ways, for long
  /// @param insist  take a younger flooded message's record if there is nothing better
  /// @return null if all records are open, or too precious when not insisting
  SWARMTALK_HOT Entry* insert(KeyArgument key, bool flood, bool insist) {
    Choice choice = {nullptr, 0};
    Entry* record = Lookup::first(records_, key);
    const Entry* const stop = Lookup::stop();
    for (; record != stop; record = Lookup::next(records_, record)) {
      record = in_register(record);
      if (P::kMessageBits < 16 && record->key.is_same_stream(key)) note(*record, key);
      consider(record, insist, kScans, choice);
    }
    if (choice.score != kOver) {
      Entry* const fresh = Lookup::fresh(records_);
      if (fresh != nullptr) {
        choice.record = fresh;
        if (!kScans) {
          fresh->key = key;
          Lookup::link(records_, fresh);
        }
      } else if (!kScans) {
        choose_cheapest(insist, choice);
        if (choice.record != nullptr) replace(*choice.record, key, flood);
        return choice.record;
      }
    }
    if (choice.record == nullptr) return nullptr;
    choice.record->key = key;  // an expired one of the chain stays in it
    renew(*choice.record, flood);
    return choice.record;
  }

  /// Makes a closed record one of another message.
  void replace(Entry& record, KeyArgument key, bool flood) {
    Lookup::unlink(records_, &record);
    record.key = key;
    Lookup::link(records_, &record);
    renew(record, flood);
  }
  /// As find() and insert() for a one-hop message that is not remembered.
  /// @param quickly  only if one look will do: the sender's last message on the channel is long
  /// over
  /// @param how      Entry::kOpen or Entry::kDelivered, as with open() and close()
  /// @return null, and nothing changed, if it is remembered, or if there is no room
  SWARMTALK_HOT Entry* begin_one_hop(const Key& key, bool quickly, uint8_t how, bool insist) {
    Entry* record = Lookup::first(records_, key);
    if (SWARMTALK_SELDOM(record == nullptr || !Lookup::is_alone(*record) || !is_spent(*record))) {
      if (quickly) return nullptr;
      if (find(key) != nullptr) return nullptr;
      const Index hand = Lookup::hand();
      record = insert(key, false, insist);
      if (record == nullptr) {
        Lookup::hand() = hand;
        return nullptr;
      }
    }
    record->key = key;
    record->forwarded = 0;
    record->flags = static_cast<uint8_t>(Entry::kKept | how);
    record->stamp = tick_;
    return record;
  }
  /// The record of a one-hop message that is being put together, its end not held. @return null if
  /// there is none, or if it is past its time
  SWARMTALK_HOT Entry* find_open_one_hop(const Key& key) {
    Entry* const record = Lookup::find(records_, key);
    return record != nullptr &&
                   (record->flags & ~Entry::kOvertaken) == (Entry::kKept | Entry::kOpen) &&
                   time_since(*record) <= static_cast<Stamp>(P::kAssemblyTicks)
               ? record
               : nullptr;
  }

  /// Makes a record that is there new: nothing forwarded or delivered.
  SWARMTALK_SHARED void renew(Entry& record, bool flood) {
    record.forwarded = 0;
    record.flags = 0;
    close(record, flood ? Entry::kKept | Entry::kFlood : Entry::kKept);
  }
  /// The message is being put together, and a packet of it came.
  void open(Entry& record) {
    record.flags = static_cast<uint8_t>(record.flags | Entry::kOpen);
    record.stamp = tick_;
  }
  /// A further packet of an open message came.
  void renew_stamp(Entry& record) { record.stamp = tick_; }
  /// @param how  Entry::kDelivered or Entry::kGivenUp
  void close(Entry& record, uint8_t how) {
    record.flags = static_cast<uint8_t>((record.flags & ~Entry::kOpen) | how);
    record.stamp = (record.flags & Entry::kFlood) != 0 ? step() : tick_;
  }

  /// Looks at the next few records. @return an open one past its time, now closed as given up
  /// (its fragments are the caller's to release), or null. Called on every packet, so that every
  /// record is looked at before its stamp wraps.
  SWARMTALK_HOT Entry* sweep() {
    return SWARMTALK_SELDOM(Turn::is_turn()) ? sweep_some() : nullptr;
  }

  /// Whether any record of the last minutes is of node `node`: an id to avoid.
  bool knows_node(typename W::NodeId node) const {
    for (const Entry& record : *this) {
      if (record.key.node() == node && record.flags != 0) return true;
    }
    return false;
  }

  // The records in use.
  const Entry* begin() const { return records_; }
  const Entry* end() const { return Lookup::end(records_); }
  /// Steps `hand` to the next of them, round and round. REQUIRES one
  SWARMTALK_SHARED Entry* next_after(Index& hand) {
    Entry* record = in_register(&records_[++hand]);
    if (record >= end()) {
      hand = 0;
      record = records_;
    }
    return record;
  }

 private:
  SWARMTALK_ASIDE Entry* sweep_some() {
    Turn::next_turn_in(Turn::kTurn);
    uint8_t left = kSweep * Turn::kTurn;
    if (Turn::kTurn > 1 && end() - begin() < left) left = static_cast<uint8_t>(end() - begin());
    for (; left != 0 && begin() != end(); --left) {
      Entry* const record = in_register(next_after(sweep_));
      if (!is_expired(*record)) continue;
      if (record->is_open()) {
        Turn::next_turn_in(1);  // the rest of this turn
        close(*record, Entry::kGivenUp);
        return record;
      }
      record->flags = 0;
    }
    return nullptr;
  }

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
  /// Score, and age, of an expired one.
  static constexpr Score kOver = static_cast<Score>(~Score{0});
  static constexpr Stamp kSurely = static_cast<Stamp>(P::kFloodSurelyTicks >> P::kClosedShift);
  struct Choice {
    Entry* record;
    Score score;
  };

  /// A closed one-hop message's record whose time is over.
  bool is_spent(const Entry& record) const {
    return (record.flags & (Entry::kOpen | Entry::kFlood)) == 0 &&
           (time_since(record) > static_cast<Stamp>(P::kOneHopDuplicateTicks) || record.flags == 0);
  }

  Stamp step() const { return P::kClosedShift == 0 ? tick_ : step_; }

  /// Time since a record's stamp, or kOver. Of a closed flooded message in 2^kClosedShift ticks.
  SWARMTALK_HOT Stamp age(const Entry& record) const {
    const uint8_t flags = record.flags;
    if (flags == 0) return kOver;
    Stamp limit = static_cast<Stamp>(P::kOneHopDuplicateTicks);
    Stamp time = tick_;
    if ((flags & Entry::kOpen) != 0) {
      limit = static_cast<Stamp>(P::kAssemblyTicks);
    } else if ((flags & Entry::kFlood) != 0) {
      limit = static_cast<Stamp>(P::kFloodTicks >> P::kClosedShift);
      time = step();
    }
    time = static_cast<Stamp>(time - record.stamp);
    return time > limit ? kOver : time;
  }

  /// A new message of this record's sender and channel has begun. If the record is of a one-hop
  /// message that is still open, that one has lost a packet. If it is of a flooded message and
  /// older than kFloodSurelyTicks, its number may be due again: it goes if it is far ahead. (Nearer
  /// ones are the sender's last, or, if this one came late, its next.)
  SWARMTALK_INLINE void note(Entry& record, const Key& key) {
    if (record.is_open()) {
      record.flags = static_cast<uint8_t>(record.flags | Entry::kOvertaken);
    } else if (record.key.is_far_from(key) && (record.flags & Entry::kFlood) != 0 &&
               age(record) > kSurely) {
      record.flags = 0;
    }
  }

  /// @param with_living  also compare records that are not expired
  SWARMTALK_INLINE void consider(Entry* record, bool insist, bool with_living, Choice& choice) {
    if (record->is_open()) return;
    Score score = age(*record);
    if (score != kOver) {
      if (!with_living) return;
      if ((record->flags & Entry::kFlood) == 0) {
        score = static_cast<Score>(score | kOneHopScore);
      } else if (!insist && score <= kSurely) {
        return;
      }
      ++score;
    }
    if (score > choice.score) {
      choice.record = record;
      choice.score = score;
    }
  }

  /// The best of the next few of a large table.
  void choose_cheapest(bool insist, Choice& choice) {
    choice.record = nullptr;
    choice.score = 0;
    for (uint8_t n = 0; n < kCompared && choice.score != kOver; ++n) {
      consider(next_after(Lookup::hand()), insist, true, choice);
    }
    if (choice.record != nullptr) Lookup::hand() = static_cast<Index>(choice.record - records_);
  }

  Entry records_[P::kRecords];
  Stamp tick_;  // now, as stamps hold it: in ticks, and in steps of 2^kClosedShift ticks
  Stamp step_;
  Index sweep_;  // the record looked at last for its age
};

}  // namespace core
}  // namespace swarmtalk
