// What makes walks along a bucket's chain of records needless where there are sixteen message
// numbers: which of its records has which number, and which messages were begun last. Kept for
// chains of two records or more, all of one sender and channel; a single record counts for itself,
// and so do those of chains in which streams are mixed. Used by RecordIndex only.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

template <class P>
struct Record;
template <class P>
struct RecordKey;

/// Which of its stream's messages a record's was, where there are summaries.
template <bool kPresent>
class RecordSerial {
 public:
  uint8_t serial() const { return serial_; }
  void set_serial(uint8_t serial) { serial_ = serial; }

 private:
  uint8_t serial_;
};
template <>
class RecordSerial<false> {
 public:
  static uint8_t serial() { return 0; }
  static void set_serial(uint8_t) {}
};

/// Places are indices of records plus 1; 0: none. Without a constructor: what is not used is not
/// touched.
template <class P, bool kPresent>
class ChainSummary {
 public:
  using Entry = Record<P>;
  using Key = RecordKey<P>;
  using Place = UintFor<bits_for(P::kRecords)>;
  using Stream = typename Key::Bits;

  /// A second record is about to come to `alone`, which has counted for itself until now.
  void begin(Entry& alone, Place place) {
    memset(place_of_, 0, sizeof(place_of_));
    place_of_[index_of(alone.key)] = place;
    begun_ = UINT32_C(0x11111111) * index_of(alone.key);
    serial_ = 0;
    alone.set_serial(static_cast<uint8_t>(1 - alone.later()));
    stream_ = alone.key.hashed();
  }
  /// Nothing is summed up: the chain has one record, or records of several streams.
  void end() { stream_ = kNoStream; }
  bool is_kept() const { return stream_ != kNoStream; }
  /// Whether it is kept, and of this key's stream.
  SWARMTALK_INLINE bool is_of(const Key& key) const { return stream_ == key.hashed(); }

  Place place_of(const Key& key) const { return place_of_[index_of(key)]; }
  /// Of the message begun last, and of the eighth before the one that begins now. Both may have
  /// been given to other messages since, and the latter may have been begun again.
  Place last() const { return place_of_[begun_ % 16]; }
  Place eighth() const { return place_of_[begun_ >> 28]; }
  /// Of the first of the last eight messages that has one still.
  Place oldest() const {
    Place place = eighth();
    for (uint32_t begun = begun_ << 4; place == 0 && begun != 0; begun <<= 4) {
      place = place_of_[begun >> 28];
    }
    return place;
  }
  bool is_eighth(const Entry& record) const {
    return record.serial() == static_cast<uint8_t>(serial_ - 7);
  }
  /// Messages begun since a record's.
  uint8_t later_than(const Entry& record) const {
    return static_cast<uint8_t>(serial_ - record.serial());
  }

  void put(const Key& key, Place place) { place_of_[index_of(key)] = place; }
  void remove(const Key& key) { place_of_[index_of(key)] = 0; }
  void move(const Key& from, const Key& to, Place place) {
    remove(from);
    put(to, place);
  }
  /// Its message begins.
  SWARMTALK_INLINE void count_begun(Entry& record, const Key& key) {
    record.set_serial(++serial_);
    begun_ = begun_ << 4 | index_of(key);
  }
  /// From now on the record counts for itself.
  void count_out(Entry& record) const {
    if (record.flags != 0 && !record.is_passed()) record.set_later(later_than(record));
  }

 private:
  static uint32_t index_of(const Key& key) { return key.number() % 16u; }
  /// None has a number in it.
  static constexpr Stream kNoStream = static_cast<Stream>(~Stream{0});

  uint32_t begun_;      // numbers of the last eight messages, the last one in the lowest four bits
  Stream stream_;       // sender and channel
  uint8_t serial_;      // of the last one
  Place place_of_[16];  // by message number
};

/// There are none.
template <class P>
class ChainSummary<P, false> {
 public:
  using Entry = Record<P>;
  using Key = RecordKey<P>;
  using Place = UintFor<bits_for(P::kRecords)>;
  static void begin(Entry&, Place) {}
  static void end() {}
  static bool is_kept() { return false; }
  static bool is_of(const Key&) { return false; }
  static Place place_of(const Key&) { return 0; }
  static Place last() { return 0; }
  static Place eighth() { return 0; }
  static Place oldest() { return 0; }
  static bool is_eighth(const Entry&) { return false; }
  static uint8_t later_than(const Entry&) { return 0; }
  static void put(const Key&, Place) {}
  static void remove(const Key&) {}
  static void move(const Key&, const Key&, Place) {}
  static void count_begun(Entry&, const Key&) {}
  static void count_out(Entry&) {}
};

}  // namespace core
}  // namespace swarmtalk
