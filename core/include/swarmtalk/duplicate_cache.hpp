// The messages a node has met lately: which of their packets it has forwarded, whether it has
// delivered them, and when. One record per message, found by (node, message, channel, epoch).
// Owned by the node; the reassembler keeps its own part of a message in the same record.
//
// A record is *open* while its message is being put together and *closed* afterwards; when room is
// short a closed one is given away (HeardMessages chooses which open one is closed for it). It says
// "a copy" of a packet until its time is over, which counts from its stamp:
//   one hop             kOneHopDuplicateTicks, for a link that repeats; while open kAssemblyTicks
//   flooded             kFloodTicks, while copies may wander
//
// Small message numbers come back. To packets from a flooded message's sender itself its record
// says "a copy" as one of one hop does, or not at all if only forwarders were heard: after that a
// packet under this name is of the sender's next message of that number, or of this one, sent once
// more. And once its sender has begun as many other messages on the channel as half of the numbers
// (kLater counts them), the number is due again. Then a record ends; one that began with its
// sender's own packet stays, closed, for its copies.
//
// Stamps may have few bits. None of those wraps unseen: with buckets each packet looks at the next
// record or records (sweep); without, each message that begins looks at all, and where none begins
// for as long as records live, all are forgotten (has_ended), also those whose time began anew.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/forecast.hpp"
#include "swarmtalk/lifetimes.hpp"
#include "swarmtalk/record.hpp"
#include "swarmtalk/record_index.hpp"
#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

template <class P>
class DuplicateCache : private RecordIndex<P, (P::kBuckets == 0)>, private Lifetimes<P> {
  using Lookup = RecordIndex<P, (P::kBuckets == 0)>;  // a base: without a table it takes no memory

 public:
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
    set_zero(looked_);
    young_ = kSurely;
    if (kScans) set_zero(records_);
    Lookup::start(records_);
  }

  /// The time of what follows, until the next call. REQUIRES forget_all() when has_ended(now)
  void set_now(uint32_t now) { now_ = now; }
  /// Whether all is to be forgotten: for longer than records live no packet has come, or, without
  /// buckets, no message has begun.
  bool has_ended(uint32_t now) const {
    return since_now(now) > kLongestLife ||
           (kScans && static_cast<uint8_t>(clock_step(now) - looked_) > kIdleSteps);
  }
  uint32_t since_now(uint32_t now) const { return now - now_; }
  uint32_t now() const { return now_; }
  void forget_all() {
    Lookup::clear(records_);
    looked_ = 0;
  }

  /// To be called before each message that may begin; draws only while there is no record.
  using Lookup::draw_secret;

  /// The message's record, whether its time is over or not, or free. @return null: there is none
  SWARMTALK_AVR_CALLED Entry* find(KeyArgument key) { return Lookup::find(records_, key); }

  /// Ticks since the record's stamp.
  SWARMTALK_AVR_CALLED Ticks age(const Entry& record) const { return since(record); }
  /// Whether a packet that belongs to this record by its key is of a later message all the same.
  /// @param direct  the packet comes from the message's sender itself, not from a forwarder
  bool is_of_later(const Entry& record, bool direct, Mask bit) const {
    return record.is_of_later(since(record), direct, bit);
  }
  /// Copies of a flooded message do not wander any more, as far as one can tell.
  bool is_stale(const Entry& record) const { return since(record) > young_; }
  /// A packet of a flooded message came that is not known to be its sender's own: forwarders may
  /// have copies waiting, so a closed record's time begins anew. Not where its sender has begun
  /// other messages since, or has sent it just now: there the time counts after which it may send
  /// that number again.
  void hear_copy(Entry& record) {
    if (record.is_open() || record.is_overtaken()) return;
    if ((record.flags & Entry::kDirect) == 0 || age(record) > 2 * kOneHopLife) {
      renew_stamp(record);
    }
  }
  /// @param packets  that wait to be sent on here; about as many wait at our neighbours
  SWARMTALK_AVR_INLINED void set_waiting(uint16_t packets) { young_ = this->wander(packets); }

  /// Begins a record for a message, closed, nothing forwarded or delivered, and counts it with its
  /// sender's other messages on the channel.
  /// @param own      its present record, past its time and not open; null: find() found none
  /// @param kind     0: one hop. Entry::kFlood: copies may come by other ways, for long; with
  ///                 Entry::kDirect or kRelayed, if it is known who sent the packet
  /// @param insist   take also a flooded message's record whose copies may still wander
  /// @param node     its expire(Entry&) is called with each open record whose time is over or whose
  ///                 number is due again: releases what it holds
  /// @return null if all (with buckets: that were looked at) are open, or too young for that
  template <class Node>
  Entry* begin_record(Entry* own, KeyArgument key, uint8_t kind, bool insist, Node& node) {
    Entry* record = own;
    if (kScans) {
      record = look_at_all(own, key, insist, node);
    } else {
      if (kNumbersReturn) {
        Lookup::for_stream(records_, key, [&](Entry& other) { note(other, key, node); });
      }
      if (record == nullptr) record = Lookup::fresh(records_);
      if (record == nullptr) {
        record = look_at_some(insist, node);
        if (record != nullptr) Lookup::unlink(records_, record);
      }
    }
    if (record == nullptr) return nullptr;
    renew(*record, key, kind);
    if (record != own) Lookup::link(records_, record);
    return record;
  }
  /// node.look_ahead() without `kept`, as where another message begins. Only without buckets.
  template <class Node>
  void look_at_others(Entry& kept, Node& node) {
    const uint8_t flags = kept.flags;
    kept.flags = 0;
    Key of_nobody;
    memset(static_cast<void*>(&of_nobody), 0xFF, sizeof(of_nobody));
    look_at_all(&kept, of_nobody, false, node);
    kept.flags = flags;
  }

  /// Makes a closed record that of a message for which begin_record() has found none.
  void replace(Entry& record, KeyArgument key, uint8_t kind) {
    Lookup::unlink(records_, &record);
    renew(record, key, kind);
    Lookup::link(records_, &record);
  }

  /// Its time begins anew.
  SWARMTALK_AVR_CALLED void renew_stamp(Entry& record) { record.stamp = static_cast<Ticks>(now_); }
  /// It is delivered, or not to be begun again.
  /// @param heard  its packets that have come: any other that comes is one more of it
  SWARMTALK_AVR_CALLED void close(Entry& record, Mask heard) {
    record.close();
    record.held = heard;
    renew_stamp(record);
  }

  /// With buckets: frees the next record if its time is over; with a narrow clock as many more as
  /// have to be looked at before their stamps wrap. Called on every packet.
  /// @param passed  ticks since the call before
  /// @param node    as in begin_record()
  template <class Node>
  void sweep(uint32_t passed, Node& node) {
    if (kScans) return;
    const auto used = static_cast<uint32_t>(Lookup::end(records_) - records_);
    uint32_t left = 1;
    if (P::kClockBits < 32) left += (passed * used) >> (P::kClockBits - 2);
    if (used < left) left = used;
    for (; left != 0; --left) {
      if (++looked_ >= used) looked_ = 0;
      Entry& record = records_[looked_];
      if (!record.is_over(since(record))) continue;
      if (record.is_open()) node.expire(record);
      record.flags = 0;
    }
  }

  /// Whether any record is of node `node`, however old: an id to avoid. (Without buckets one that
  /// was never used counts as node 0's.)
  bool knows_node(typename Wire<P>::NodeId node) const {
    const Entry* record = records_;
    for (auto left = static_cast<Index>(Lookup::end(records_) - record); left != 0; --left) {
      if (record->key.node() == node) return true;
      record = in_register(record + 1);
    }
    return false;
  }

 private:
  /// age(), for code that looks at all records.
  SWARMTALK_AVR_INLINED Ticks since(const Entry& record) const {
    return static_cast<Ticks>(static_cast<Ticks>(now_) - record.stamp);
  }
  static constexpr bool kNumbersReturn = Entry::kNumbersReturn;
  /// Messages that a record counts as one (see kMostLater).
  static constexpr uint32_t kMessagesPerCount = kNumbersReturn && P::kMessageBits > 4
                                                    ? UINT32_C(1) << (P::kMessageBits - 4) % 16
                                                    : 1;
  using Lifetimes<P>::kAssemblyLife;
  using Lifetimes<P>::kFloodLife;
  using Lifetimes<P>::kLongestLife;
  using Lifetimes<P>::kOneHopLife;
  using Lifetimes<P>::kSurely;
  /// The upper 8 bits of the clock that stamps are read from.
  static uint8_t clock_step(uint32_t now) {
    return static_cast<uint8_t>(static_cast<Ticks>(now) >> (P::kClockBits - 8));
  }
  /// Longer than records live without a new stamp, but not half as long as the clock counts.
  static constexpr uint8_t kIdleSteps = kLongestLife >> (P::kClockBits - 8) < 125
                                            ? (kLongestLife >> (P::kClockBits - 8)) + 1
                                            : 125;
  /// Records of a table with buckets that are looked at to find one to give away.
  static constexpr uint8_t kCompared = 8;

  /// How willingly a record is given away: expired ones first, then one-hop ones by age, then
  /// flooded ones by age; 0: none.
  using Score = UintFor<bits_for(UINT32_C(3) + kFloodLife + kOneHopLife)>;
  /// Score of an expired one.
  static constexpr Score kOver = static_cast<Score>(~Score{0});
  struct Choice {
    Entry* record;
    Score score;
  };

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
    // As many have begun as half of the numbers.
    if ((flags & Entry::kOpen) != 0) {
      node.expire(record);
      record.close();
    }
    if ((flags & Entry::kDirect) == 0) record.flags = 0;
  }

  /// Without buckets: the best of all records for a message that begins, which is noted with its
  /// sender's other messages; and what the node wants to know of the open ones, in one walk.
  template <class Node>
  SWARMTALK_AVR_CALLED Entry* look_at_all(Entry* own, KeyArgument key, bool insist, Node& node) {
    Choice choice = {own, own == nullptr ? Score{0} : kOver};
    looked_ = clock_step(now_);
    OpenMessages<P> open;
    const Ticks now = in_register(static_cast<Ticks>(now_));
    const Entry* const stop = Lookup::end(records_);
    for (Entry* record = records_; record != stop; ++record) {
      record = in_register(record);
      if (kNumbersReturn && record->key.is_same_stream(key)) note(*record, key, node);
      consider(record, now, insist, choice, open, node);
    }
    node.look_ahead(open);
    return choice.record;
  }
  /// Takes it if it is the best until now, or counts it if it is open.
  template <class Node>
  SWARMTALK_AVR_INLINED void consider(Entry* record, Ticks now, bool insist, Choice& choice,
                                      OpenMessages<P>& open, Node& node) {
    const uint8_t flags = record->flags;
    const Ticks passed = static_cast<Ticks>(now - record->stamp);
    Score score = kOver;
    if ((flags & Entry::kOpen) != 0) {
      if (passed <= ((flags & Entry::kFlood) != 0 ? kFloodLife : kAssemblyLife)) {
        if (kScans) open.add(record, node.worth(*record));
        return;
      }
      node.expire(*record);
    } else if (flags != 0) {
      if ((flags & Entry::kFlood) == 0) {
        if (passed <= kOneHopLife) score = static_cast<Score>(passed + (kFloodLife + 1u));
      } else if (passed <= kFloodLife) {
        if (!insist && passed <= young_) return;
        score = static_cast<Score>(passed + 1u);
      }
    }
    if (score == kOver) record->flags = 0;
    if (score > choice.score) {
      choice.record = record;
      choice.score = score;
    }
  }
  /// With buckets: the first of the next few records that is no flooded message's, or is over; else
  /// the best of them. The next call goes on after it: they are given away in the order in which
  /// they began.
  template <class Node>
  Entry* look_at_some(bool insist, Node& node) {
    Choice choice = {nullptr, 0};
    OpenMessages<P> open;
    for (uint8_t left = kCompared; left != 0 && choice.score <= kFloodLife + 1u; --left) {
      consider(Lookup::next_in_turn(records_), static_cast<Ticks>(now_), insist, choice, open,
               node);
    }
    if (choice.record != nullptr) Lookup::turn_to(static_cast<Index>(choice.record - records_));
    return choice.record;
  }

  uint32_t now_;
  /// With buckets the record whose age was looked at last; without, the clock_step() in which all
  /// were.
  Index looked_;
  Ticks young_;  // a flooded message is, up to this age
  Entry records_[P::kRecords];
};

}  // namespace core
}  // namespace swarmtalk
