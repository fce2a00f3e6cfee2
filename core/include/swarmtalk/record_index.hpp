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
  /// The first two fields of a header, as one number.
  using MessageOfNode = core::bits::Field<0, P::kNodeBits + P::kMessageBits>;
  static constexpr uint8_t kMessageShift = P::kChannelBits;
  static constexpr uint8_t kNodeShift = P::kChannelBits + P::kMessageBits;
  static constexpr Bits kMessageBitsMask =
      static_cast<Bits>(static_cast<Bits>(W::kMessageMask) << kMessageShift);
  Bits bits;

  RecordKey() {}
  /// Of a packet's message.
  explicit RecordKey(const uint8_t* packet)
      : bits(static_cast<Bits>(
            static_cast<Bits>(static_cast<Bits>(MessageOfNode::get(packet)) << kMessageShift) |
            W::ChannelField::get(packet))) {
    this->set(W::EpochField::get(packet));
  }
  bool operator==(const RecordKey& other) const {
    return bits == other.bits && this->get() == other.get();
  }
  /// Same sender and channel.
  bool is_same_stream(const RecordKey& other) const {
    return ((bits ^ other.bits) & static_cast<Bits>(~kMessageBitsMask)) == 0 &&
           this->get() == other.get();
  }
  /// How a key is handed over: in registers where it is narrow.
  using Argument = typename Conditional<(sizeof(Bits) <= 2 && P::kEpochBits == 0), const RecordKey,
                                        const RecordKey&>::Type;
  typename W::NodeId node() const { return static_cast<typename W::NodeId>(bits >> kNodeShift); }
  /// Of two messages of one stream: whether this one's number is in the middle half of those ahead
  /// of `other`'s. (Nearer ones are just before or just after it.)
  bool is_far_from(const RecordKey& other) const {
    constexpr Bits kQuarter =
        static_cast<Bits>(((W::kMessageMask >> 2) + Bits{1}) << kMessageShift);
    return static_cast<Bits>((bits - other.bits - kQuarter) & kMessageBitsMask) <
           static_cast<Bits>(2 * kQuarter);
  }
  /// Bucket of the key. Small message numbers are left out, so that all messages of a sender and
  /// channel are in one chain (at most 2^kMessageBits of them).
  uint16_t bucket() const {
    constexpr uint8_t kBucketBits = P::kBuckets < 2 ? 1 : bits_for(P::kBuckets - 1u);
    const Bits seed = P::kMessageBits < 16 ? bits & static_cast<Bits>(~kMessageBitsMask) : bits;
    // The upper bits of a product with a large odd number (2^n / golden ratio) depend on all bits.
    if (sizeof(Bits) <= 4 && P::kEpochBits == 0) {
      return static_cast<uint16_t>(
          static_cast<uint32_t>(static_cast<uint32_t>(seed) * UINT32_C(0x9E3779B1)) >>
          (32 - kBucketBits));
    }
    const uint64_t mixed =
        (seed ^ (static_cast<uint64_t>(this->get()) << 48)) * UINT64_C(0x9E3779B97F4A7C15);
    return static_cast<uint16_t>(mixed >> (64 - kBucketBits));
  }
};

/// Link of a record's chain, if there are chains.
template <class P, bool kPresent>
struct RecordLink {
  UintFor<bits_for(P::kRecords)> next_;
};
template <class P>
struct RecordLink<P, false> {};

/// What is known of a message's length where packets have their exact length: the message's size
/// where each packet tells it, else the bytes of its last packet.
template <bool kPresent>
struct KnownLength {
  uint16_t length_;
  void set_length(uint16_t bytes) { length_ = bytes; }
  uint16_t length() const { return length_; }
};
template <>
struct KnownLength<false> {
  void set_length(uint16_t) {}
  uint16_t length() const { return 0; }
};

/// What a node remembers of a message: the cache's part, and the reassembler's (held, first).
template <class P>
struct Record : RecordLink<P, (P::kBuckets > 0)>, KnownLength<!P::kPadded> {
  using Mask = typename Wire<P>::PacketMask;
  using Stamp = UintFor<P::kStampBits>;
  using Slot = UintFor<bits_for(P::kFragmentSlots)>;

  enum : uint8_t {
    kKept = 1,  // in every record in use; flags of 0: expired
    kOpen = 2,
    kDelivered = 4,
    kGivenUp = 8,  // lost a packet for want of memory or time: not to be begun again
    kFlood = 16,
    kOvertaken = 32,  // its sender was heard beginning another message on the channel since
    kEndHeld = 64,    // the highest packet held is the message's last
  };
  RecordKey<P> key;
  uint8_t flags;
  Mask forwarded;  // one bit per packet
  Mask held;       // dito; undefined while not open, like `first`
  Stamp stamp;     // tick of the last packet; of a closed flooded message in 2^kClosedShift ticks
  Slot first;      // list of fragments, highest sequence first

  bool is_open() const { return (flags & kOpen) != 0; }
  /// Delivered, or not to be.
  bool is_done() const { return (flags & (kDelivered | kGivenUp)) != 0; }
};

/// Chains. Indices in the table are stored plus 1, so that an empty table is all zeros.
template <class P, bool kScan>
class RecordIndex {
 public:
  using Index = UintFor<bits_for(P::kRecords)>;
  using Entry = Record<P>;
  static constexpr Index kNone = P::kRecords;

  explicit RecordIndex(Entry*) : used_(0), hand_(0) { memset(heads_, 0, sizeof(heads_)); }

  SWARMTALK_HOT Entry* find(Entry* records, const RecordKey<P>& key) {
    const Index head = heads_[key.bucket()];
    if (head == 0) return nullptr;
    Entry* record = &records[head - 1];
    while (!(record->key == key)) {
      if (record->next_ == kNone) return nullptr;
      record = &records[record->next_];
    }
    return record;
  }
  void link(Entry* records, Entry* record) {
    Index& head = heads_[record->key.bucket()];
    record->next_ = head == 0 ? kNone : static_cast<Index>(head - 1);
    head = static_cast<Index>(record - records + 1);
  }
  void unlink(Entry* records, Entry* record) {
    Index& head = heads_[record->key.bucket()];
    const Index i = static_cast<Index>(record - records);
    if (head == i + 1) {
      head = record->next_ == kNone ? Index{0} : static_cast<Index>(record->next_ + 1);
      return;
    }
    Index before = static_cast<Index>(head - 1);
    while (records[before].next_ != i) before = records[before].next_;
    records[before].next_ = record->next_;
  }
  Entry* first(Entry* records, const RecordKey<P>& key) const {
    const Index head = heads_[key.bucket()];
    return head == 0 ? nullptr : &records[head - 1];
  }
  Entry* next(Entry* records, const Entry* record) const {
    return record->next_ == kNone ? nullptr : &records[record->next_];
  }
  /// What follows the last one of a walk from first().
  static const Entry* stop() { return nullptr; }
  const Entry* end(const Entry* records) const { return records + used_; }
  /// A record that has never been used, or null.
  Entry* fresh(Entry* records) { return used_ < P::kRecords ? &records[used_++] : nullptr; }
  /// Whether no record follows in the chain.
  bool is_alone(const Entry& record) const { return record.next_ == kNone; }
  /// The record given away last: those after it are the oldest, roughly.
  Index& hand() { return hand_; }

 private:
  Index heads_[P::kBuckets];
  Index used_;  // records 0..used_-1 have been used; the rest is untouched memory
  Index hand_;
};

/// No table: all records in use are looked at.
template <class P>
class RecordIndex<P, true> {
 public:
  using Entry = Record<P>;

  explicit RecordIndex(Entry* records) : end_(records) {}

  Entry* find(Entry* records, typename RecordKey<P>::Argument key) {
    const Entry* const stop = end_;
    for (Entry* record = records; record != stop; record = in_register(record + 1)) {
      if (record->key == key) return record;
    }
    return nullptr;
  }
  void link(Entry*, Entry*) {}
  void unlink(Entry*, Entry*) {}
  Entry* first(Entry* records, const RecordKey<P>&) const { return records; }
  Entry* next(Entry*, Entry* record) const { return record + 1; }
  const Entry* stop() const { return end_; }
  const Entry* end(const Entry*) const { return end_; }
  Entry* fresh(Entry* records) { return end_ == records + P::kRecords ? nullptr : end_++; }
  UintFor<bits_for(P::kRecords)>& hand() {  // for code that is not reached
    static UintFor<bits_for(P::kRecords)> none;
    return none;
  }
  bool is_alone(const Entry&) const { return false; }

 private:
  Entry* end_;  // behind the records in use
};

}  // namespace core
}  // namespace swarmtalk
