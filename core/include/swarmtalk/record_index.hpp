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
  typename W::MessageNumber number() const {
    return static_cast<typename W::MessageNumber>(bits >> kMessageShift & W::kMessageMask);
  }
  typename W::NodeId node() const { return static_cast<typename W::NodeId>(bits >> kNodeShift); }
  /// What tells the key's bucket. Small message numbers are left out, so that all messages of a
  /// sender and channel are in one chain (at most 2^kMessageBits of them).
  Bits hashed() const {
    return P::kMessageBits < 16 ? bits & static_cast<Bits>(~kMessageBitsMask) : bits;
  }
};

/// From a key to its bucket: the upper bits of a product with a large odd number depend on all
/// bits. Where keys are wide enough for an attacker to choose many of one bucket, the numbers are
/// secret, one for each part of the key (multiply-add-shift hashing: whatever keys are chosen
/// beforehand, two share a bucket about as seldom as if buckets were drawn).
template <class P, bool kSecret>
class BucketOf {
 protected:
  static constexpr bool kHasSecret = true;
  void set_secret(uint64_t a, uint64_t b) {
    factor_ = a | 1;
    epoch_factor_ = b | 1;
  }
  uint16_t bucket(const RecordKey<P>& key) const {
    return static_cast<uint16_t>((key.hashed() * factor_ + key.get() * epoch_factor_) >>
                                 (64 - bits_for(P::kBuckets - 1u)));
  }

 private:
  uint64_t factor_ = 0;
  uint64_t epoch_factor_ = 0;
};
template <class P>
class BucketOf<P, false> {
 protected:
  static constexpr bool kHasSecret = false;
  void set_secret(uint64_t, uint64_t) {}
  static uint16_t bucket(const RecordKey<P>& key) {
    constexpr uint8_t kBucketBits = bits_for(P::kBuckets - 1u);
    if (sizeof(key.bits) <= 4 && P::kEpochBits == 0) {  // 2^32, or 2^64, / golden ratio
      return static_cast<uint16_t>(
          static_cast<uint32_t>(static_cast<uint32_t>(key.hashed()) * UINT32_C(0x9E3779B1)) >>
          (32 - kBucketBits));
    }
    const uint64_t mixed =
        (key.hashed() ^ (static_cast<uint64_t>(key.get()) << 48)) * UINT64_C(0x9E3779B97F4A7C15);
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

/// Whether the packets held have timestamps, where that may differ.
template <bool kPresent>
struct TimestampMark {
  bool has_timestamps_;
  void set_timestamps(bool has) { has_timestamps_ = has; }
  bool is_other(bool has) const { return has != has_timestamps_; }
};
template <>
struct TimestampMark<false> {
  void set_timestamps(bool) {}
  bool is_other(bool) const { return false; }
};

/// What a node remembers of a message: the cache's part, and the reassembler's (held, first).
template <class P>
struct Record : RecordLink<P, (P::kBuckets > 0)>,
                KnownLength<!P::kPadded>,
                TimestampMark<Wire<P>::kKindsMayMix> {
  using Mask = typename Wire<P>::PacketMask;
  using Stamp = UintFor<P::kClockBits>;
  using Slot = UintFor<bits_for(P::kFragmentSlots)>;

  enum : uint8_t {
    kRelayed = 1,  // of a flooded message, begun with a packet that a forwarder had sent
    kOpen = 2,
    kDone = 4,     // of a closed one: delivered or given up, and not begun again while it lives
    kEndHeld = 4,  // of an open one: the highest packet held is the message's last
    kFlood = 8,
    kDirect = 16,  // of a flooded message, begun with a packet that its sender itself had sent
    kLater = 32,   // times how many messages its sender has begun on the channel since: 0 to 7
  };
  /// Half of the numbers is one more than is counted: in messages, or in groups of them where there
  /// are more.
  static constexpr uint8_t kMostLater =
      static_cast<uint8_t>(P::kMessageBits >= 4 ? 7 : (1u << (P::kMessageBits - 1)) - 1u);
  uint8_t flags;  // 0: free
  RecordKey<P> key;
  Mask forwarded;  // one bit per packet
  Mask held;       // the same; of a closed one that is done: the packets heard. Else undefined
  Stamp stamp;     // tick from which its time counts: of the last packet of it that was new, mostly
  Slot first;      // list of fragments, highest sequence first; undefined while not open

  void close() { flags = static_cast<uint8_t>((flags & ~kOpen) | kDone); }
  bool is_open() const { return (flags & kOpen) != 0; }
  /// Delivered, or not to be.
  bool is_done() const { return (flags & (kOpen | kDone)) == kDone; }
  bool is_flood() const { return (flags & kFlood) != 0; }
  /// Its sender was heard beginning another message on the channel since.
  bool is_overtaken() const { return flags >= kLater; }
  /// It was heard beginning as many as are counted.
  bool is_passed() const { return flags >= static_cast<uint8_t>(kMostLater * kLater); }
};

/// Chains.
template <class P, bool kScan>
class RecordIndex : BucketOf<P, (P::kMessageBits >= 16)> {
  using Hash = BucketOf<P, (P::kMessageBits >= 16)>;

 public:
  static constexpr bool kHasSecret = Hash::kHasSecret;
  using Hash::set_secret;
  using Index = UintFor<bits_for(P::kRecords)>;
  using Entry = Record<P>;
  static constexpr Index kNone = P::kRecords;

  void start(Entry* records) { clear(records); }
  void clear(Entry*) {
    used_ = 0;
    hand_ = 0;
    memset(heads_, 0, sizeof(heads_));
  }

  Entry* find(Entry* records, const RecordKey<P>& key) {
    const Index head = heads_[Hash::bucket(key)];
    if (head == 0) return nullptr;
    for (Entry* record = &records[head - 1];; record = &records[record->next_]) {
      if (record->key == key) return record;
      if (record->next_ == kNone) return nullptr;
    }
  }
  void link(Entry* records, Entry* record) {
    Index& head = heads_[Hash::bucket(record->key)];
    record->next_ = head == 0 ? kNone : static_cast<Index>(head - 1);
    head = static_cast<Index>(record - records + 1);
  }
  void unlink(Entry* records, Entry* record) {
    Index& head = heads_[Hash::bucket(record->key)];
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
    const Index head = heads_[Hash::bucket(key)];
    if (head == 0) return;
    for (Entry* record = &records[head - 1];; record = &records[record->next_]) {
      if (record->key.is_same_stream(key)) count(*record);
      if (record->next_ == kNone) return;
    }
  }
  const Entry* end(const Entry* records) const { return records + used_; }
  /// A record that has never been used, or null.
  Entry* fresh(Entry* records) { return used_ < P::kRecords ? &records[used_++] : nullptr; }
  bool is_unused() const { return used_ == 0; }
  /// All that have been used, round and round: the oldest, roughly. REQUIRES that one has
  Entry* next_in_turn(Entry* records) {
    if (++hand_ >= used_) hand_ = 0;
    return &records[hand_];
  }
  /// The last one that next_in_turn() gave, or one before it.
  void turn_to(Index place) { hand_ = place; }

 private:
  Index heads_[P::kBuckets];
  Index used_;  // records 0..used_-1 have been used; the rest is untouched memory
  Index hand_;
};

/// No table: all records in use are looked at. On AVR all, free ones too, which is what the search
/// costs there at worst anyway, and less code.
template <class P>
class RecordIndex<P, true> {
 public:
  using Entry = Record<P>;

#ifdef __AVR__
  static void start(Entry*) {}
  SWARMTALK_AVR_CALLED void clear(Entry* records) {
    for (UintFor<bits_for(P::kRecords)> left = P::kRecords; left != 0; --left)
      (records++)->flags = 0;
  }
  const Entry* end(const Entry* records) const {
    return records + P::kRecords;
  }
  Entry* fresh(Entry*) {
    return nullptr;
  }
#else
  void start(Entry* records) {
    end_ = records;
  }
  void clear(Entry* records) {
    end_ = records;
  }
  const Entry* end(const Entry*) const {
    return end_;
  }
  Entry* fresh(Entry* records) {
    return end_ == records + P::kRecords ? nullptr : end_++;
  }
#endif

  Entry* find(Entry* records, typename RecordKey<P>::Argument key) {
#ifdef __AVR__  // counting is quicker than comparing addresses
    Entry* record = records;
    for (UintFor<bits_for(P::kRecords)> left = P::kRecords; left != 0; --left) {
      if (record->key == key) return record;
      record = in_register(record + 1);
    }
#else
    for (Entry* record = records; record != end_; ++record) {
      if (record->key == key) return record;
    }
#endif
    return nullptr;
  }
  void link(Entry*, Entry*) {}
  void unlink(Entry*, Entry*) {}
  template <class Count>
  void for_stream(Entry*, const RecordKey<P>&, const Count&) {}
  Entry* next_in_turn(Entry* records) {
    return records;
  }
  void turn_to(uint32_t) {}
  static constexpr bool kHasSecret = false;
  bool is_unused() const {
    return false;
  }
  void set_secret(uint64_t, uint64_t) {}
#ifndef __AVR__

 private:
  Entry* end_;  // behind the records in use
#endif
};

}  // namespace core
}  // namespace swarmtalk
