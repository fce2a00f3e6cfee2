// The messages a node has met lately: which of their packets it has forwarded, whether it has
// delivered them, and when. One record per message, found by (node, message, channel, epoch).
// Owned by the node; the reassembler keeps its own part of a message in the same record.
//
// A record is *open* while its message is being put together and *closed* afterwards; only a closed
// one is given away when room is short. It says "a copy" of a packet until its time is over:
//   one hop             kOneHopDuplicateTicks, for a link that repeats; while open kAssemblyTicks
//   flooded             kFloodTicks, while copies may wander
//   flooded, to packets from the message's sender itself: as one hop, or not at all if only
//                       forwarders were heard. It sends a number again for another message only.
// Small message numbers come back, so a record also ends when its sender has begun as many other
// messages on the channel as half of the numbers (kLater counts them): the number is due again.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/forecast.hpp"
#include "swarmtalk/lifetimes.hpp"
#include "swarmtalk/record_index.hpp"
#include "swarmtalk/sweep_turn.hpp"
#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class DuplicateCache : private RecordIndex<P, (P::kBuckets == 0)>,
                       private SweepTurn<(P::kBuckets > 0)>,
                       private Lifetimes<P> {
  using Lookup = RecordIndex<P, (P::kBuckets == 0)>;  // a base: without a table it takes no memory
  using Turn = SweepTurn<(P::kBuckets > 0)>;

 public:
  using W = Wire<P>;
  using Key = RecordKey<P>;
  using KeyArgument = typename Key::Argument;
  using Entry = Record<P>;
  using Mask = typename Entry::Mask;
  using Ticks = UintFor<P::kClockBits>;
  using Index = UintFor<bits_for(P::kRecords)>;
  /// Without buckets every new message looks at every record anyway.
  static constexpr bool kScans = P::kBuckets == 0;

  SWARMTALK_PART(DuplicateCache)
  void start() {
    set_zero(now_);
    set_zero(sweep_);
    young_.start();
    if (kScans) set_zero(records_);
    Lookup::start(records_);
  }
  DuplicateCache(const DuplicateCache&) = delete;
  DuplicateCache& operator=(const DuplicateCache&) = delete;

  /// The time of what follows, until the next call. REQUIRES forget_all() when has_ended(now)
  void set_now(uint32_t now) { now_ = now; }
  /// Whether the time of everything remembered has ended since the last set_now().
  bool has_ended(uint32_t now) const { return since_now(now) > kLongestLife; }
  uint32_t since_now(uint32_t now) const { return now - now_; }
  uint32_t now() const { return now_; }
  void forget_all() {
    Lookup::clear(records_);
    sweep_ = 0;
  }

  /// Before the first message, where hashing needs numbers that nobody else knows.
  bool needs_secret() const { return kHasSecret && Lookup::is_unused(); }
  void set_secret(uint64_t a, uint64_t b) { Lookup::set_secret(a, b); }

  /// The message's record, whether its time is over or not. @return null if there is none
  SWARMTALK_AVR_CALLED Entry* find(KeyArgument key) { return Lookup::find(records_, key); }

  /// Ticks since the last packet that was no copy.
  SWARMTALK_AVR_CALLED Ticks age(const Entry& record) const { return since(record); }
  /// Whether the time of a record is over, or it is free.
  SWARMTALK_AVR_INLINED bool is_over(const Entry& record) const {
    return is_over(record.flags, since(record));
  }
  /// Whether a packet that belongs to this record by its key is of a later message all the same.
  /// @param direct  the packet comes from the message's sender itself, not from a forwarder
  bool is_of_later(const Entry& record, bool direct, Mask bit) {
    if (is_over(record)) return true;
    const uint8_t flags = record.flags;
    if (!kNumbersReturn || (flags & Entry::kFlood) == 0) return false;
    if (!direct) {
      return (flags & Entry::kDirect) != 0 && age(record) > kSurely && record.is_passed();
    }
    if ((flags & Entry::kOpen) != 0) {  // it sends a message in one piece
      return (flags & Entry::kDirect) != 0 && (record.is_overtaken() || age(record) > kSurely);
    }
    if (!record.is_overtaken() &&
        ((record.is_done() ? record.held : record.forwarded) & bit) == 0) {
      return false;  // a packet more of a message that was not put together
    }
    return (flags & Entry::kDirect) != 0 ? age(record) > kOneHopLife
                                         : (flags & Entry::kRelayed) != 0;
  }
  /// Copies of a flooded message do not wander any more, as far as one can tell.
  bool is_stale(const Entry& record) const { return since(record) > young_.ticks(); }
  /// A copy of a flooded message came by a forwarder: others may have more of them waiting. Where
  /// its sender has gone on they are late, and the time that counts is its own.
  void hear_copy(Entry& record) {
    if (record.is_open() || record.is_overtaken()) return;
    if ((record.flags & Entry::kDirect) == 0 || age(record) > 2 * kOneHopLife) {
      renew_stamp(record);
    }
  }
  /// @param packets  that wait to be sent on here; about as many wait at our neighbours
  SWARMTALK_AVR_INLINED void set_waiting(uint16_t packets) { young_.set_waiting(packets); }

  /// Begins a record for a message, closed, nothing forwarded or delivered, and counts it with its
  /// sender's other messages on the channel.
  /// @param own      its present record, past its time and not open; null: find() found none
  /// @param kind     0: one hop. Entry::kFlood: copies may come by other ways, for long; with
  ///                 Entry::kDirect or kRelayed, if it is known who sent the packet
  /// @param insist   take a younger flooded message's record if there is nothing better
  /// @param node     its end(Entry&) is called with an open record whose message has been passed:
  ///                 releases what it holds, at most once a call
  /// @return null if all records are open, or too precious when not insisting
  template <class Node>
  Entry* begin(Entry* own, KeyArgument key, uint8_t kind, bool insist, Node& node) {
    Choice choice = kScans ? look_at_all(own, key, insist, node) : look_at_chain(own, key, node);
    bool is_linked = choice.score == kOver;  // in this chain, or there are none
    if (!is_linked) {
      Entry* const fresh = Lookup::fresh(records_);
      if (fresh != nullptr) choice.record = fresh;
      if (fresh == nullptr && !kScans) {
        choice.record = next_to_give_away(insist);
        if (choice.record != nullptr) Lookup::unlink(records_, choice.record);
      }
    }
    if (choice.record == nullptr) return nullptr;
    put(*choice.record, is_linked, key, kind, node);
    return choice.record;
  }
  /// The open messages other than `kept`: see node.look_ahead(). Only without buckets.
  template <class Node>
  void look_at_others(Entry& kept, Node& node) {
    const uint8_t flags = kept.flags;
    kept.flags = 0;
    Key of_nobody;
    memset(static_cast<void*>(&of_nobody), 0xFF, sizeof(of_nobody));
    look_at_all(&kept, of_nobody, false, node);
    kept.flags = flags;
  }

  /// Makes a closed record one of another message.
  template <class Node>
  void replace(Entry& record, KeyArgument key, uint8_t kind, Node& node) {
    Lookup::unlink(records_, &record);
    put(record, false, key, kind, node);
  }

  /// The message is being put together, and a packet of it came.
  void open(Entry& record) {
    record.flags = static_cast<uint8_t>((record.flags & ~Entry::kDone) | Entry::kOpen);
    renew_stamp(record);
  }
  /// A packet came that is no copy.
  SWARMTALK_AVR_CALLED void renew_stamp(Entry& record) { record.stamp = static_cast<Ticks>(now_); }
  /// It is delivered, or not to be begun again.
  /// @param heard  its packets that have come: any other that comes is one more of it
  SWARMTALK_AVR_CALLED void close(Entry& record, Mask heard) {
    record.close();
    record.held = heard;
    renew_stamp(record);
  }

  /// Looks at the next few records and frees those past their time. @return an open one of them,
  /// whose fragments are the caller's to release, or null. Called on every packet, so that every
  /// record is looked at before its stamp wraps.
  Entry* sweep() { return !kScans && Turn::is_turn() ? sweep_some() : nullptr; }

  /// Whether any record of the last minutes is of node `node`: an id to avoid.
  bool knows_node(typename W::NodeId node) const {
    const Entry* record = begin();
    for (auto left = static_cast<Index>(end() - record); left != 0; --left) {
      if (record->key.node() == node && record->flags != 0) return true;
      record = in_register(record + 1);
    }
    return false;
  }

  // The records that have been used; without buckets, all.
  const Entry* begin() const { return records_; }
  Entry* begin() { return records_; }
  const Entry* end() const { return Lookup::end(records_); }
  /// The next of them, round and round. REQUIRES one
  Entry* next_after(Entry* record) {
    ++record;
    return record >= end() ? records_ : record;
  }

 private:
  /// age(), for code that looks at all records.
  SWARMTALK_AVR_INLINED Ticks since(const Entry& record) const {
    return static_cast<Ticks>(static_cast<Ticks>(now_) - record.stamp);
  }
  /// Steps a hand to the next record.
  Entry* step(Index& hand) {
    Entry* const record = next_after(&records_[hand]);
    hand = static_cast<Index>(record - records_);
    return record;
  }
  Entry* sweep_some() {
    Turn::next_turn_in(Turn::kTurn);
    // All of them in a quarter of the clock's range, however seldom the calls are.
    const auto used = static_cast<uint16_t>(end() - begin());
    uint32_t left = Turn::kTurn;
    if (P::kClockBits < 32) left += (Turn::since_last(now_) * used) >> (P::kClockBits - 2);
    if (used < left) left = used;
    Entry* record = &records_[sweep_];
    Entry* open = nullptr;
    const Entry* const stop = end();
    const Ticks now = static_cast<Ticks>(now_);
    for (; left != 0; --left) {
      if (++record >= stop) record = records_;
      const uint8_t flags = record->flags;
      if (flags == 0 || !is_over(flags, static_cast<Ticks>(now - record->stamp))) continue;
      if ((flags & Entry::kOpen) != 0) {
        open = record;
        Turn::next_turn_in(1);  // the rest of this turn
        break;
      }
      record->flags = 0;
    }
    sweep_ = static_cast<Index>(record - records_);
    return open;
  }

  /// Small numbers are the next message's of the same sender soon.
  static constexpr bool kNumbersReturn = P::kMessageBits < 16;
  /// Messages that a record counts as one (see kMostLater).
  static constexpr uint32_t kMessagesPerCount = kNumbersReturn && P::kMessageBits > 4
                                                    ? UINT32_C(1) << (P::kMessageBits - 4) % 16
                                                    : 1;
  static constexpr bool kHasSecret = Lookup::kHasSecret;
  /// With more in one chain than chance would bring, a new one takes the place of the last.
  static constexpr uint8_t kLongestChain = 16;
  /// Records of a large table that are looked at to find one to give away.
  static constexpr uint8_t kCompared = 8;

  using Lifetimes<P>::kAssemblyLife;
  using Lifetimes<P>::kFloodLife;
  using Lifetimes<P>::kLongestLife;
  using Lifetimes<P>::kOneHopLife;
  using Lifetimes<P>::kSurely;
  static SWARMTALK_AVR_INLINED bool is_over(uint8_t flags, Ticks passed) {
    return flags == 0 || passed > ((flags & Entry::kFlood) != 0  ? kFloodLife
                                   : (flags & Entry::kOpen) != 0 ? kAssemblyLife
                                                                 : kOneHopLife);
  }

  /// How willingly a record is given away: expired ones first, then one-hop ones by age, then
  /// flooded ones by age; 0: none.
  using Score = UintFor<bits_for(UINT32_C(3) + kFloodLife + kOneHopLife)>;
  /// Score of an expired one.
  static constexpr Score kOver = static_cast<Score>(~Score{0});
  struct Choice {
    Entry* record;
    Score score;
  };

  /// Makes a record a new message's, which is noted with its sender's others.
  /// @param is_linked  it is in the message's chain already
  template <class Node>
  void put(Entry& record, bool is_linked, KeyArgument key, uint8_t kind, Node& node) {
    if (kScans) return renew(record, key, kind);
    if (kNumbersReturn) {
      Lookup::for_stream(records_, key,
                         [this, &key, &node](Entry& other) { note(other, key, node); });
    }
    renew(record, key, kind);
    if (!is_linked) Lookup::link(records_, &record);
  }
  /// Makes a record that is there new: nothing forwarded or delivered.
  SWARMTALK_AVR_CALLED void renew(Entry& record, KeyArgument key, uint8_t kind) {
    record.key = key;
    record.forwarded = 0;
    record.flags = kind;
    renew_stamp(record);
  }

  /// A new message of this record's sender and channel begins. After half of the numbers the
  /// record's own is due again: its time ends. What was heard from its sender itself stays for a
  /// while, closed: late copies are known by it, and it does not stand in that sender's way.
  template <class Node>
  SWARMTALK_AVR_INLINED void note(Entry& record, KeyArgument key, Node& node) {
    const uint8_t flags = record.flags;
    if (flags == 0) return;
    if (kMessagesPerCount > 1 && record.is_overtaken() && key.number() % kMessagesPerCount != 0) {
      return;
    }
    const uint8_t counted = static_cast<uint8_t>(flags + Entry::kLater);
    if (!record.is_passed()) {
      record.flags = counted;
      return;
    }
    pass(record, node);
  }
  /// As many have begun as half of the numbers.
  template <class Node>
  SWARMTALK_AVR_INLINED void pass(Entry& record, Node& node) {
    const uint8_t flags = record.flags;
    if ((flags & Entry::kOpen) != 0) node.end(record);
    if ((flags & Entry::kDirect) == 0) record.flags = 0;
  }

  /// The record for a message that begins, which is noted with its sender's other messages; and
  /// what the node wants to know of the open ones, all in one walk.
  template <class Node>
  SWARMTALK_AVR_CALLED Choice look_at_all(Entry* own, KeyArgument key, bool insist, Node& node) {
    Choice choice = {own, own == nullptr ? Score{0} : kOver};
    OpenMessages<P> open;
    const Ticks now = in_register(static_cast<Ticks>(now_));
    const Entry* const stop = end();
    for (Entry* record = records_; record != stop; ++record) {
      record = in_register(record);
      if (kNumbersReturn && record->key.is_same_stream(key)) note(*record, key, node);
      consider(record, now, insist, choice, open, node);
    }
    node.look_ahead(open);
    return choice;
  }
  /// Takes it if it is the best until now, or counts it if it is open.
  template <class Node>
  SWARMTALK_AVR_INLINED void consider(Entry* record, Ticks now, bool insist, Choice& choice,
                                      OpenMessages<P>& open, Node& node) {
    const uint8_t flags = record->flags;
#ifndef __AVR__  // there the most that a walk may take counts, and that is with open ones
    if (choice.score == kOver && (flags & Entry::kOpen) == 0) return;
#endif
    const Ticks passed = static_cast<Ticks>(now - record->stamp);
    Score score = kOver;
    if ((flags & Entry::kOpen) != 0) {
      if (passed <= ((flags & Entry::kFlood) != 0 ? kFloodLife : kAssemblyLife)) {
        return open.add(record, node.worth(*record));
      }
      if (choice.score == kOver) return;  // one is enough for a call
      node.end(*record);
    } else if (flags != 0) {
      if ((flags & Entry::kFlood) == 0) {
        if (passed <= kOneHopLife) score = static_cast<Score>(passed + (kFloodLife + 1u));
      } else if (passed <= kFloodLife) {
        if (!insist && passed <= young_.ticks()) return;
        score = static_cast<Score>(passed + 1u);
      }
    }
    if (score > choice.score) {
      choice.record = record;
      choice.score = score;
    }
  }
  /// A record of a chain that is over, for a message that begins there.
  template <class Node>
  Choice look_at_chain(Entry* own, KeyArgument key, Node& node) {
    if (own != nullptr) return {own, kOver};
    uint8_t looks = 0;
    Entry* record = Lookup::first(records_, key);
    for (; record != nullptr; record = Lookup::next(records_, record)) {
      if (kNumbersReturn) {
        if (!is_over(*record)) continue;
        if (record->is_open()) node.end(*record);
        return {record, kOver};
      }
      if (++looks >= kLongestChain && !record->is_open()) return {record, kOver};
    }
    return {nullptr, 0};
  }

  /// The next of a large table that is closed; a flooded message's only if the next few are all of
  /// such, or open. The hand goes round, so it is about the oldest.
  Entry* next_to_give_away(bool insist) {
    Entry* chosen = nullptr;
    Index at = Lookup::hand();
    for (uint8_t n = 0; n < kCompared; ++n) {
      Entry* const record = step(at);
      if (record->is_open()) continue;
      const bool is_precious = record->is_flood() && !is_over(*record);
      if (is_precious && (chosen != nullptr || (!insist && age(*record) <= young_.ticks()))) {
        continue;
      }
      chosen = record;
      Lookup::hand() = at;
      if (!is_precious) break;
    }
    if (chosen == nullptr) Lookup::hand() = at;  // the next time those behind
    return chosen;
  }

  uint32_t now_;
  Index sweep_;  // the record looked at last for its age
  WanderTime<P, kScans> young_;
  Entry records_[P::kRecords];
};

}  // namespace core
}  // namespace swarmtalk
