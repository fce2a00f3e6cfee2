// How a message's record is found: by its key, in a hash table of chains, or by scanning when there
// are few (a profile with kBuckets = 0 saves the table and the links). Used by DuplicateCache only.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/port.hpp"
#include "swarmtalk/record.hpp"
#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

/// Chains. From a key to its bucket: the upper bits of a product with a large odd number depend on
/// all bits. Where keys are wide enough for an attacker to choose many of one bucket, the numbers
/// are secret, one for each part of the key (multiply-add-shift hashing: whatever keys are chosen
/// beforehand, two share a bucket about as seldom as if buckets were drawn). A sender's numbers
/// follow each other, and the multiples of some factors meet in few buckets: a second product, of
/// a number that is known to spread them, parts what the drawn one has put side by side.
template <class P, bool kScan>
class RecordIndex {
 public:
  using Index = UintFor<bits_for(P::kRecords)>;
  using Entry = Record<P>;
  static constexpr Index kNone = P::kRecords;

  void start(Entry* records) {
    factor_ = kGolden;
    epoch_factor_ = UINT64_C(0xD1B54A32D192ED03);
    clear(records);
  }
  void clear(Entry*) {
    used_ = 0;
    hand_ = 0;
    memset(heads_, 0, sizeof(heads_));
  }

  Entry* find(Entry* records, const RecordKey<P>& key) {
    const Index head = heads_[bucket(key)];
    if (head == 0) return nullptr;
    for (Entry* record = &records[head - 1];; record = &records[record->next_]) {
      if (record->key == key) return record;
      if (record->next_ == kNone) return nullptr;
    }
  }
  void link(Entry* records, Entry* record) {
    Index& head = heads_[bucket(record->key)];
    record->next_ = head == 0 ? kNone : static_cast<Index>(head - 1);
    head = static_cast<Index>(record - records + 1);
  }
  void unlink(Entry* records, Entry* record) {
    Index& head = heads_[bucket(record->key)];
    const Index i = static_cast<Index>(record - records);
    if (head == i + 1) {
      head = record->next_ == kNone ? Index{0} : static_cast<Index>(record->next_ + 1);
    } else {
      Index before = static_cast<Index>(head - 1);
      while (records[before].next_ != i) before = records[before].next_;
      records[before].next_ = record->next_;
    }
  }
  /// Calls `count(Entry&)` with each record of a key's stream.
  template <class Count>
  void for_stream(Entry* records, const RecordKey<P>& key, const Count& count) {
    const Index head = heads_[bucket(key)];
    if (head == 0) return;
    for (Entry* record = &records[head - 1];; record = &records[record->next_]) {
      if (record->key.is_same_stream(key)) count(*record);
      if (record->next_ == kNone) return;
    }
  }
  const Entry* end(const Entry* records) const { return records + used_; }
  /// A record that has never been used, or null.
  Entry* fresh(Entry* records) { return used_ < P::kRecords ? &records[used_++] : nullptr; }
  /// Before the first record, where hashing needs numbers that nobody else knows.
  void draw_secret(const Port& port) {
    if (P::kMessageBits < 16 || used_ != 0) return;
    factor_ = draw(port) | 1;
    epoch_factor_ = draw(port) | 1;
  }
  /// All that have been used, round and round: the oldest, roughly. REQUIRES that one has
  Entry* next_in_turn(Entry* records) {
    if (++hand_ >= used_) hand_ = 0;
    return &records[hand_];
  }
  /// The last one that next_in_turn() gave, or one before it.
  void turn_to(Index place) { hand_ = place; }

 private:
  static uint64_t draw(const Port& port) {
    const uint64_t upper = port.random(port.context);
    return upper << 32 | port.random(port.context);
  }
  uint16_t bucket(const RecordKey<P>& key) const {
    uint64_t mixed = key.hashed() * factor_ + key.get() * epoch_factor_;
    mixed ^= mixed >> 32;
    return static_cast<uint16_t>((mixed * kGolden) >> (64 - bits_for(P::kBuckets - 1u)));
  }
  static constexpr uint64_t kGolden = UINT64_C(0x9E3779B97F4A7C15);  // 2^64 / golden ratio

  uint64_t factor_;
  uint64_t epoch_factor_;
  Index heads_[P::kBuckets];
  Index used_;  // records 0..used_-1 have been used; the rest is untouched memory
  Index hand_;
};

/// No table: all records are looked at, free ones too, which is what the search costs at worst
/// anyway.
template <class P>
class RecordIndex<P, true> {
 public:
  using Entry = Record<P>;

  static void start(Entry*) {}
  SWARMTALK_AVR_CALLED void clear(Entry* records) {
    for (UintFor<bits_for(P::kRecords)> left = P::kRecords; left != 0; --left) {
      (records++)->flags = 0;
    }
  }
  static const Entry* end(const Entry* records) { return records + P::kRecords; }
  Entry* find(Entry* records, typename RecordKey<P>::Argument key) {
    Entry* record = records;  // AVR counts quicker than it compares addresses
    for (UintFor<bits_for(P::kRecords)> left = P::kRecords; left != 0; --left) {
      if (record->key == key) return record;
      record = in_register(record + 1);
    }
    return nullptr;
  }
  static Entry* fresh(Entry*) { return nullptr; }
  static void link(Entry*, Entry*) {}
  static void unlink(Entry*, Entry*) {}
  template <class Count>
  static void for_stream(Entry*, const RecordKey<P>&, const Count&) {}
  static Entry* next_in_turn(Entry* records) { return records; }
  static void turn_to(uint32_t) {}
  static void draw_secret(const Port&) {}
};

}  // namespace core
}  // namespace swarmtalk
