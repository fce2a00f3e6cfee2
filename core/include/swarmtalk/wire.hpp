// The packet format of a profile: where each field stands. Pure functions over bytes; called by the
// fragmenter (encode), the node (decode) and the forward queue (TTL, timestamp, checksum).
//
//   header | payload | timestamp (timestamped packets) | checksum (if the profile has one)
//
// The header is one bit string, most significant bit first, padded with zeros to whole bytes:
//   node | message | sequence | end (1) | channel | ttl | hops | size | epoch | timestamped |
//   gateway
// The first six are the header of Zhang et al., AAMAS 2020, fig. 1; the others are 0 bits wide in
// the profiles that keep to it.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/bits.hpp"
#include "swarmtalk/checksum.hpp"
#include "swarmtalk/profile.hpp"
#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

template <class P>
struct Wire {
  using Checked = CheckedProfile<P>;
  static_assert(Checked::kIsSound, "");

  using NodeId = UintFor<P::kNodeBits>;
  using MessageNumber = UintFor<P::kMessageBits>;
  using Sequence = UintFor<P::kSequenceBits>;
  using ChannelId = UintFor<P::kChannelBits>;
  using Epoch = UintFor<P::kEpochBits>;
  using Timestamp = UintFor<P::kTimestampBits>;
  using Ticks = UintFor<P::kClockBits>;
  /// Of what waits to be sent: as long as a timestamp can tell, whatever the clock's width.
  using WaitTicks =
      UintFor<(P::kClockBits > P::kTimestampBits ? P::kClockBits : P::kTimestampBits)>;

  static constexpr uint16_t kHeaderBytes = Checked::kHeaderBytes;
  static constexpr uint16_t kChecksumBytes = Checked::kChecksumBytes;
  static constexpr uint16_t kTimestampBytes = Checked::kTimestampBytes;
  static constexpr uint16_t kMtuBytes = P::kMtuBytes;
  static constexpr uint16_t kBodyBytes = kMtuBytes - kHeaderBytes - kChecksumBytes;
  static constexpr uint16_t kPayloadBytes = kBodyBytes;
  /// Whether a message arrives with its exact length; if not, it is padded to whole packets.
  static constexpr bool kTellsLengths = !P::kPadded;
  static constexpr uint16_t kTimedPayloadBytes =
      P::kTimestampBits == 0 ? 0 : kBodyBytes - kTimestampBytes;

  using PacketSize = UintFor<bits_for(P::kMtuBytes)>;  // of a packet or a part of it

  static constexpr NodeId kNoNode = static_cast<NodeId>(low_bits(P::kNodeBits));
  /// Ids from here on are for gateways, where packets have no bit to say that they crossed one; no
  /// node draws them. kNoNode: there are none.
  static constexpr NodeId kFirstGatewayId =
      static_cast<NodeId>(P::kGatewayBits == 0 && P::kNodeBits == 8 ? 248 : kNoNode);
  static constexpr MessageNumber kMessageMask =
      static_cast<MessageNumber>(low_bits(P::kMessageBits));
  static constexpr uint8_t kTtlMax = static_cast<uint8_t>(low_bits(P::kTtlBits));
  static constexpr uint16_t kChannelMax = static_cast<uint16_t>(low_bits(P::kChannelBits));
  static constexpr Timestamp kTimestampMax = static_cast<Timestamp>(low_bits(P::kTimestampBits));

  static constexpr uint32_t smaller(uint32_t a, uint32_t b) { return a < b ? a : b; }
  static constexpr uint32_t larger(uint32_t a, uint32_t b) { return a < b ? b : a; }
  /// What sequence number, size field and profile allow, for `payload` per packet.
  static constexpr uint32_t allowed_bytes(uint16_t payload) {
    return smaller(smaller(static_cast<uint32_t>(payload) << P::kSequenceBits, P::kMaxMessageBytes),
                   P::kSizeBits == 0 ? UINT32_C(65535) : low_bits(P::kSizeBits));
  }
  /// Where packets are padded, a message arrives as whole packets: `bytes` up to the end of the
  /// last of them, or the most that 65535 bytes hold.
  static constexpr uint16_t as_it_arrives(uint32_t bytes, uint16_t payload) {
    return static_cast<uint16_t>(
        P::kPadded ? payload * smaller((bytes + payload - 1) / payload, UINT32_C(65535) / payload)
                   : bytes);
  }
  static constexpr uint16_t kTimedStep = kTimedPayloadBytes == 0 ? 1 : kTimedPayloadBytes;
  static constexpr uint16_t kTimedWanted =
      as_it_arrives(allowed_bytes(kTimedPayloadBytes), kTimedStep);
  /// Longest message that is sent or put together, without timestamps and with them. A timestamped
  /// one is never longer, so the first is what a buffer for any message holds.
  static constexpr uint16_t kMessageBytes =
      as_it_arrives(larger(allowed_bytes(kPayloadBytes), kTimedWanted), kPayloadBytes);
  static constexpr uint16_t kTimedMessageBytes =
      kTimedWanted <= kMessageBytes
          ? kTimedWanted
          : static_cast<uint16_t>(kMessageBytes / kTimedStep * kTimedStep);
  static constexpr uint16_t packets_for(uint16_t size, uint16_t payload) {
    return static_cast<uint16_t>(size == 0 ? 1
                                           : (static_cast<uint32_t>(size) + payload - 1) / payload);
  }
  static constexpr uint16_t kMaxPackets = packets_for(kTimedMessageBytes, kTimedStep) >
                                                  packets_for(kMessageBytes, kPayloadBytes)
                                              ? packets_for(kTimedMessageBytes, kTimedStep)
                                              : packets_for(kMessageBytes, kPayloadBytes);
  static_assert(kMaxPackets <= 32, "a message has at most 32 packets: lower kMaxMessageBytes");
  /// One bit per packet of a message.
  using PacketMask = UintFor<kMaxPackets>;
  static PacketMask bit_of(Sequence sequence) {
    return one_bit<PacketMask>(static_cast<uint8_t>(sequence));
  }
  using MessageSize = UintFor<bits_for(kMessageBytes)>;

  /// Whether sequence numbers go beyond the longest message, of either kind, and no size field
  /// tells.
  static constexpr bool kLimitsPlaces =
      P::kSizeBits == 0 &&
      (kMessageBytes < static_cast<uint32_t>(kPayloadBytes) << P::kSequenceBits ||
       kTimedMessageBytes < static_cast<uint32_t>(kTimedPayloadBytes) << P::kSequenceBits);
  /// Whether a packet of `payload_bytes`, of a full one's length unless it is the end, lies within
  /// the longest message of its kind; after one that is not the end something follows.
  static bool is_within_message(Sequence sequence, bool end, bool timestamped,
                                PacketSize payload_bytes) {
    const uint32_t limit = timestamped ? kTimedMessageBytes : kMessageBytes;
    const uint16_t payload = timestamped ? kTimedPayloadBytes : kPayloadBytes;
    const uint32_t behind = static_cast<uint32_t>(sequence) * payload + payload_bytes;
    return end ? behind <= limit : behind < limit;
  }

  /// What the profile's numbers cost in buffers: packets to forward, fragments, send buffers,
  /// records.
  static constexpr uint64_t kBufferBytes =
      static_cast<uint64_t>(P::kForwardSlots) * P::kMtuBytes +
      static_cast<uint64_t>(P::kFragmentSlots) * (kBodyBytes + 1u) +
      static_cast<uint64_t>(P::kChannels) * kMessageBytes +
      static_cast<uint64_t>(P::kRecords) *
          ((P::kNodeBits + P::kMessageBits + P::kChannelBits + P::kEpochBits + P::kClockBits) / 8u +
           4u);
  static_assert(
      kBufferBytes <= P::kBufferBudgetBytes,
      "this profile's buffers exceed its RAM budget: lower kForwardSlots, kFragmentSlots, "
      "kChannels or kRecords, or raise kBufferBudgetBytes");

  struct Header {
    NodeId node;            // origin of the message
    MessageNumber message;  // counts up by one per (origin, channel), wraps
    Sequence sequence;      // of the packet in its message
    bool end;               // the message's last packet
    ChannelId channel;
    uint8_t ttl;                                        // hops still allowed
    uint8_t hops;                                       // travelled, if there is a field
    typename bits::Field<0, P::kSizeBits>::Value size;  // of the whole message, if there is a field
    Epoch epoch;                                        // of the origin; 0 without a field
    bool has_delay;                                     // the packet carries a timestamp
    bool crossed_gateway;                               // a gateway copied it
  };

  // Positions: each field starts where the one before it ends.
  static constexpr uint16_t kMessageAt = P::kNodeBits;
  static constexpr uint16_t kSequenceAt = kMessageAt + P::kMessageBits;
  static constexpr uint16_t kEndAt = kSequenceAt + P::kSequenceBits;
  static constexpr uint16_t kChannelAt = kEndAt + 1;
  static constexpr uint16_t kTtlAt = kChannelAt + P::kChannelBits;
  static constexpr uint16_t kHopsAt = kTtlAt + P::kTtlBits;
  static constexpr uint16_t kSizeAt = kHopsAt + P::kHopsBits;
  static constexpr uint16_t kEpochAt = kSizeAt + P::kSizeBits;
  static constexpr uint16_t kTimestampedAt = kEpochAt + P::kEpochBits;
  static constexpr uint16_t kGatewayAt = kTimestampedAt + P::kTimestampedBits;

  using NodeField = bits::Field<0, P::kNodeBits>;
  using MessageField = bits::Field<kMessageAt, P::kMessageBits>;
  using SequenceField = bits::Field<kSequenceAt, P::kSequenceBits>;
  using EndField = bits::Field<kEndAt, 1>;
  using ChannelField = bits::Field<kChannelAt, P::kChannelBits>;
  using TtlField = bits::Field<kTtlAt, P::kTtlBits>;
  using HopsField = bits::Field<kHopsAt, P::kHopsBits>;
  using SizeField = bits::Field<kSizeAt, P::kSizeBits>;
  using EpochField = bits::Field<kEpochAt, P::kEpochBits>;
  using TimestampedField = bits::Field<kTimestampedAt, P::kTimestampedBits>;
  using GatewayField = bits::Field<kGatewayAt, P::kGatewayBits>;

  /// Bytes kByte to kEnd - 1 of an encoded header, each from the fields that are in it.
  template <uint16_t kByte, uint16_t kEnd>
  struct EncodedByte {
    static SWARMTALK_AVR_INLINED void write(const Header& header, uint8_t* packet) {
      packet[kByte] =
          static_cast<uint8_t>(NodeField::template part<kByte>(header.node) |
                               MessageField::template part<kByte>(header.message) |
                               SequenceField::template part<kByte>(header.sequence) |
                               EndField::template part<kByte>(header.end) |
                               ChannelField::template part<kByte>(header.channel) |
                               TtlField::template part<kByte>(header.ttl) |
                               HopsField::template part<kByte>(header.hops) |
                               SizeField::template part<kByte>(header.size) |
                               EpochField::template part<kByte>(header.epoch) |
                               TimestampedField::template part<kByte>(header.has_delay) |
                               GatewayField::template part<kByte>(header.crossed_gateway));
      EncodedByte<kByte + 1, kEnd>::write(header, packet);
    }
  };
  template <uint16_t kEnd>
  struct EncodedByte<kEnd, kEnd> {
    static void write(const Header&, uint8_t*) {}
  };

  /// Reads the header at the start of `packet` (at least kHeaderBytes). Padding bits are ignored.
  static SWARMTALK_AVR_INLINED void decode(const uint8_t* packet, Header& header) {
    header.node = NodeField::get(packet);
    header.message = MessageField::get(packet);
    header.sequence = SequenceField::get(packet);
    header.end = EndField::get(packet) != 0;
    header.channel = ChannelField::get(packet);
    header.ttl = TtlField::get(packet);
    header.hops = HopsField::get(packet);
    header.size = SizeField::get(packet);
    header.epoch = EpochField::get(packet);
    header.has_delay = is_timestamped(packet);
    header.crossed_gateway = GatewayField::get(packet) != 0;
  }
  static Header decode(const uint8_t* packet) {
    Header header;
    decode(packet, header);
    return header;
  }

  /// Writes kHeaderBytes at `packet`, padding bits 0. Values are cut to their width.
  static SWARMTALK_AVR_INLINED void encode(const Header& header, uint8_t* packet) {
    EncodedByte<0, kHeaderBytes>::write(header, packet);
  }

  /// Whether the packet says that it carries a timestamp (see kMarksTimestamps).
  static bool is_timestamped(const uint8_t* packet) {
    return P::kTimestampedBits != 0 ? TimestampedField::get(packet) != 0
           : P::kTimestampedFrom > kChannelMax
               ? false
               : ChannelField::get(packet) >= static_cast<ChannelId>(P::kTimestampedFrom);
  }

  /// Whether channel numbers or a flag on the wire tell every forwarder what is timestamped; if
  /// not (2020 format), only a robot that registered the channel knows.
  static constexpr bool kMarksTimestamps =
      P::kTimestampedBits != 0 || P::kTimestampedFrom != kNoTimestampedChannels;

  /// Whether packets of one message that come with a timestamp and without could do harm: somebody
  /// sends such, or the channel was opened anew, and places end differently.
  static constexpr bool kKindsMayMix =
      P::kTimestampedBits != 0 ||
      (P::kTimestampBits != 0 && P::kTimestampedFrom == kNoTimestampedChannels &&
       (!P::kPadded || kLimitsPlaces));

  /// A copy one hop further: TTL down, hops up (staying at its largest value), all else kept.
  /// REQUIRES ttl of the packet > 0.
  static void count_hop(uint8_t* packet, const Header& header) {
    TtlField::put(packet, static_cast<uint8_t>(header.ttl - 1));
    if (P::kHopsBits != 0 && header.hops != static_cast<uint8_t>(low_bits(P::kHopsBits))) {
      HopsField::put(packet, static_cast<typename HopsField::Value>(header.hops + 1));
    }
  }

  static void set_hops(uint8_t* packet, uint8_t hops) {
    HopsField::put(packet, static_cast<typename HopsField::Value>(hops));
  }

  /// Whether `a` and `b` are copies of one packet, whatever way they came: all fields before the
  /// TTL are equal, and the epoch.
  static bool is_same_packet(const uint8_t* a, const uint8_t* b) {
    constexpr uint16_t kWhole = kTtlAt / 8;
    constexpr uint8_t kRest = static_cast<uint8_t>(0xFF00u >> kTtlAt % 8);
    for (uint8_t i = 0; i < kWhole; ++i) {
      if (a[i] != b[i]) return false;
    }
    return ((a[kWhole] ^ b[kWhole]) & kRest) == 0 && EpochField::get(a) == EpochField::get(b);
  }
  /// Whether two packets are of one sender and channel.
  static bool is_same_stream(const uint8_t* a, const uint8_t* b) {
    return NodeField::is_same(a, b) && ChannelField::is_same(a, b) && EpochField::is_same(a, b);
  }
  static uint8_t ttl(const uint8_t* packet) { return TtlField::get(packet); }

  /// Timestamp in the last bytes of a body (little-endian) of `body_bytes` bytes.
  /// REQUIRES body_bytes >= kTimestampBytes.
  static SWARMTALK_AVR_INLINED Timestamp timestamp(const uint8_t* body, PacketSize body_bytes) {
    Timestamp ticks = 0;
    for (uint8_t i = kTimestampBytes; i-- > 0;) {
      ticks =
          static_cast<Timestamp>(static_cast<Timestamp>(ticks << (kTimestampBytes > 1 ? 8 : 0)) |
                                 body[body_bytes - kTimestampBytes + i]);
    }
    return static_cast<Timestamp>(ticks & kTimestampMax);
  }
  static SWARMTALK_AVR_INLINED void set_timestamp(uint8_t* body, PacketSize body_bytes,
                                                  Timestamp ticks) {
    for (uint8_t i = 0; i < kTimestampBytes; ++i) {
      body[body_bytes - kTimestampBytes + i] = static_cast<uint8_t>(ticks);
      ticks = static_cast<Timestamp>(ticks >> (kTimestampBytes > 1 ? 8 : 0));
    }
  }

  /// A delay `waited` ticks later; stays at kTimestampMax, which means "at least".
  SWARMTALK_AVR_CALLED static Timestamp later(Timestamp delay, WaitTicks waited) {
    return waited >= static_cast<WaitTicks>(kTimestampMax - delay)
               ? kTimestampMax
               : static_cast<Timestamp>(delay + waited);
  }

  /// Puts the checksum, if any, behind the first `size` bytes. @return bytes of the whole packet
  static SWARMTALK_AVR_INLINED PacketSize seal(uint8_t* packet, PacketSize size) {
    if (kChecksumBytes != 0) packet[size] = checksum<P::kChecksum>(packet, size);
    return static_cast<PacketSize>(size + kChecksumBytes);
  }
  /// Whether a packet of `size` bytes has a length that exists and is undamaged.
  static Error check(const uint8_t* packet, uint16_t size) {
    if (P::kPadded ? size != kMtuBytes
                   : (size < kHeaderBytes + kChecksumBytes || size > kMtuBytes)) {
      return Error::kBadPacket;
    }
    if (kChecksumBytes != 0 &&
        packet[size - 1] != checksum<P::kChecksum>(packet, static_cast<uint16_t>(size - 1))) {
      return Error::kBadChecksum;
    }
    return Error::kOk;
  }
};

}  // namespace core
}  // namespace swarmtalk
