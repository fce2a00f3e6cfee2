// What a node remembers of a message, and the name under which it does. Used by DuplicateCache,
// which keeps the records, RecordIndex, which finds them, and the reassembler.
#pragma once

#include <stdint.h>

#include "swarmtalk/lifetimes.hpp"
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
struct Record : Lifetimes<P>,
                RecordLink<P, (P::kBuckets > 0)>,
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
  /// Small numbers are the next message's of the same sender soon.
  static constexpr bool kNumbersReturn = P::kMessageBits < 16;
  /// The count ends here; one more is half of the numbers. With more than 4 bits it counts groups
  /// of messages.
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
  /// Whether its time is over, or it is free.
  /// @param age  ticks since its stamp
  SWARMTALK_AVR_INLINED bool is_over(Stamp age) const {
    return flags == 0 || age > ((flags & kFlood) != 0  ? kFloodLife
                                : (flags & kOpen) != 0 ? kAssemblyLife
                                                       : kOneHopLife);
  }
  /// Whether a packet that belongs to this record by its key is of a later message all the same.
  /// @param age     ticks since its stamp
  /// @param direct  the packet comes from the message's sender itself, not from a forwarder
  bool is_of_later(Stamp age, bool direct, Mask bit) const {
    if (is_over(age)) return true;
    if (!kNumbersReturn || (flags & kFlood) == 0) return false;
    if (!direct) return (flags & kDirect) != 0 && age > kSurely && is_passed();
    if ((flags & kOpen) != 0) {  // it sends a message in one piece
      return (flags & kDirect) != 0 && (is_overtaken() || age > kSurely);
    }
    if (!is_overtaken() && ((is_done() ? held : forwarded) & bit) == 0) {
      return false;  // a packet more of a message that was not put together
    }
    return (flags & kDirect) != 0 ? age > kOneHopLife : (flags & kRelayed) != 0;
  }

 private:
  using Lifetimes<P>::kAssemblyLife;
  using Lifetimes<P>::kFloodLife;
  using Lifetimes<P>::kOneHopLife;
  using Lifetimes<P>::kSurely;
};

}  // namespace core
}  // namespace swarmtalk
