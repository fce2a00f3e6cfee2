// How a message's record is found: by its key, in a hash table of chains, or by scanning when there
// are few (a profile with kBuckets = 0 saves the table and the links). Used by DuplicateCache only.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/types.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk {
namespace core {

/// Epoch of a key, if the profile has epochs.
template <class E, bool kPresent>
struct KeyEpoch {
  E epoch_;
  void set(E epoch) { epoch_ = epoch; }
  E get() const { return epoch_; }
};
template <class E>
struct KeyEpoch<E, false> {
  void set(E) {}
  E get() const { return 0; }
};

/// Name of a message: node, message number, channel and epoch, packed.
template <class P>
struct RecordKey : KeyEpoch<typename Wire<P>::Epoch, (P::kEpochBits > 0)> {
  using W = Wire<P>;
  using Bits = UintFor<P::kNodeBits + P::kMessageBits + P::kChannelBits>;
  static constexpr uint8_t kMessageShift = P::kChannelBits;
  static constexpr uint8_t kNodeShift = P::kChannelBits + P::kMessageBits;
  static constexpr Bits kMessageBitsMask =
      static_cast<Bits>(static_cast<Bits>(W::kMessageMask) << kMessageShift);
  Bits bits;

  RecordKey() {}
  explicit RecordKey(const typename W::Header& header)
      : bits(static_cast<Bits>(
            static_cast<Bits>(static_cast<Bits>(header.node) << kNodeShift) |
            static_cast<Bits>(static_cast<Bits>(header.message) << kMessageShift) |
            header.channel)) {
    this->set(header.epoch);
  }
  bool operator==(const RecordKey& other) const {
    return bits == other.bits && this->get() == other.get();
  }
  /// Same sender and channel.
  bool is_same_stream(const RecordKey& other) const {
    return ((bits ^ other.bits) & static_cast<Bits>(~kMessageBitsMask)) == 0 &&
           this->get() == other.get();
  }
  typename W::NodeId node() const { return static_cast<typename W::NodeId>(bits >> kNodeShift); }
  typename W::MessageNumber message() const {
    return static_cast<typename W::MessageNumber>((bits & kMessageBitsMask) >> kMessageShift);
  }
  /// Bucket of the key. Small message numbers are left out, so that all messages of a sender and
  /// channel are in one chain (at most 2^kMessageBits of them).
  uint16_t bucket() const {
    const uint64_t seed = P::kMessageBits < 16 ? bits & static_cast<Bits>(~kMessageBitsMask) : bits;
    const uint64_t mixed =
        (seed ^ (static_cast<uint64_t>(this->get()) << 48)) * UINT64_C(0x9E3779B97F4A7C15);
    return static_cast<uint16_t>((mixed >> 40) & (P::kBuckets - 1u));
  }
};

/// Link of a record's chain, if there are chains.
template <class P, bool kPresent>
struct RecordLinkIf {
  UintFor<bits_for(P::kRecords)> next_;
};
template <class P>
struct RecordLinkIf<P, false> {};
template <class P>
struct RecordLink : RecordLinkIf<P, (P::kBuckets > 0)> {};

/// Chains. Indices in the table are stored plus 1, so that an empty table is all zeros.
template <class P, bool kScan>
class RecordIndex {
 public:
  using Index = UintFor<bits_for(P::kRecords)>;
  static constexpr Index kNone = P::kRecords;

  RecordIndex() { memset(heads_, 0, sizeof(heads_)); }

  template <class Record>
  Index find(const Record* records, Index, const RecordKey<P>& key) const {
    Index i = first(key);
    while (i != kNone && !(records[i].key == key)) i = records[i].next_;
    return i;
  }
  template <class Record>
  void link(Record* records, Index i) {
    Index& head = heads_[records[i].key.bucket()];
    records[i].next_ = head == 0 ? kNone : static_cast<Index>(head - 1);
    head = static_cast<Index>(i + 1);
  }
  template <class Record>
  void unlink(Record* records, Index i) {
    Index& head = heads_[records[i].key.bucket()];
    if (head == i + 1) {
      head = records[i].next_ == kNone ? Index{0} : static_cast<Index>(records[i].next_ + 1);
      return;
    }
    Index before = static_cast<Index>(head - 1);
    while (records[before].next_ != i) before = records[before].next_;
    records[before].next_ = records[i].next_;
  }
  Index first(const RecordKey<P>& key) const {
    const Index head = heads_[key.bucket()];
    return head == 0 ? kNone : static_cast<Index>(head - 1);
  }
  template <class Record>
  Index next(const Record* records, Index i) const {
    return records[i].next_;
  }
  bool is_valid(Index i, Index) const { return i != kNone; }

 private:
  Index heads_[P::kBuckets];
};

/// No table: all records are looked at.
template <class P>
class RecordIndex<P, true> {
 public:
  using Index = UintFor<bits_for(P::kRecords)>;
  static constexpr Index kNone = P::kRecords;

  template <class Record>
  Index find(const Record* records, Index used, const RecordKey<P>& key) const {
    const Record* record = records;
    for (Index i = 0; i < used; ++i, record = in_register(record + 1)) {
      if (record->key == key) return i;
    }
    return kNone;
  }
  template <class Record>
  void link(Record*, Index) {}
  template <class Record>
  void unlink(Record*, Index) {}
  Index first(const RecordKey<P>&) const { return 0; }
  template <class Record>
  Index next(const Record*, Index i) const {
    return static_cast<Index>(i + 1);
  }
  bool is_valid(Index i, Index used) const { return i < used; }
};

}  // namespace core
}  // namespace swarmtalk
