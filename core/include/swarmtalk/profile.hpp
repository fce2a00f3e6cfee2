// A profile is a struct of compile-time numbers: the wire format, the memory and the time limits of
// one kind of node. This file holds the defaults that a profile inherits and the checks that refuse
// an impossible one with a sentence. The profiles themselves are in profiles/.
#pragma once

#include <stdint.h>

#include "swarmtalk/checksum.hpp"
#include "swarmtalk/types.hpp"

namespace swarmtalk {
namespace core {

/// No channel number marks a channel as timestamped.
constexpr uint32_t kNoTimestampedChannels = UINT32_C(0xFFFFFFFF);

/// Defaults of all profiles. Derive from it and hide what differs; see profiles/kilobot.hpp.
struct ProfileDefaults {
  // Wire format. Header fields in the order of wire.hpp; width 0 leaves a field out.
  static constexpr uint16_t kMtuBytes = 9;     // longest packet, all included
  static constexpr uint8_t kNodeBits = 8;      // 2^bits - 1 ids; all ones means "no node"
  static constexpr uint8_t kMessageBits = 4;   // message number, wraps
  static constexpr uint8_t kSequenceBits = 3;  // fragment index: 2^bits packets per message
  static constexpr uint8_t kChannelBits = 4;
  static constexpr uint8_t kTtlBits = 4;
  static constexpr uint8_t kHopsBits = 0;         // hops travelled
  static constexpr uint8_t kSizeBits = 0;         // bytes of the whole message
  static constexpr uint8_t kEpochBits = 0;        // start of the sender's program
  static constexpr uint8_t kTimestampedBits = 0;  // 0 or 1: this packet carries a timestamp
  static constexpr uint8_t kGatewayBits = 0;      // 0 or 1: this message crossed a gateway
  static constexpr uint8_t kTimestampBits = 16;   // at the end of a timestamped packet, in ticks
  static constexpr Checksum kChecksum = Checksum::kNone;
  static constexpr bool kPadded = true;  // every packet has kMtuBytes; lengths are lost
  static constexpr uint32_t kTimestampedFrom = kNoTimestampedChannels;  // first such channel
  static constexpr bool kHopsFromTtl = true;  // robots agree on a channel's TTL: hops = difference

  // Memory, all of it inside the node.
  static constexpr uint16_t kChannels = 2;
  static constexpr uint8_t kPublishers = 1;       // per channel
  static constexpr uint8_t kSubscribers = 1;      // per channel
  static constexpr uint16_t kForwardSlots = 10;   // packets
  static constexpr uint16_t kFragmentSlots = 40;  // packets waiting for the rest of their message
  static constexpr uint16_t kRecords = 24;        // messages remembered as heard or in assembly
  static constexpr uint16_t kBuckets = 0;  // hash buckets to find them, a power of 2; 0: scan
  /// Cut to what the wire allows; where packets are padded, up to the end of a message's last one.
  static constexpr uint32_t kMaxMessageBytes = UINT32_C(0xFFFFFFFF);
  static constexpr uint32_t kBufferBudgetBytes = 2048;  // for the buffers above
  using Counter = uint16_t;                             // counts saturate at its largest value

  // Time, in ticks of the port's clock.
  static constexpr uint8_t kClockBits = 16;  // width in which the node counts time
  static constexpr uint32_t kAssemblyTicks =
      100;  // a one-hop message with no new fragment: given up
  static constexpr uint32_t kOneHopDuplicateTicks =
      8;                                              // copies of a one-hop message are recognised
  static constexpr uint32_t kFloodSurelyTicks = 224;  // copies of a flooded message: at least...
  static constexpr uint32_t kFloodTicks = 2000;       // ... and at most, unless its number returns

  static constexpr uint8_t kForwardRepeats = 0;  // further transmissions of each forwarded packet
  /// How far and how long packets of others travel can be limited: Swarmtalk::limit_forwarding().
  static constexpr bool kLimitsForwarding = false;
};

/// Compiles only if profile P can work; says in a sentence what is wrong otherwise.
template <class P>
struct CheckedProfile {
  static constexpr uint16_t kHeaderBits =
      P::kNodeBits + P::kMessageBits + P::kSequenceBits + 1 + P::kChannelBits + P::kTtlBits +
      P::kHopsBits + P::kSizeBits + P::kEpochBits + P::kTimestampedBits + P::kGatewayBits;
  static constexpr uint16_t kHeaderBytes = (kHeaderBits + 7) / 8;
  static constexpr uint16_t kTimestampBytes = (P::kTimestampBits + 7) / 8;
  static constexpr uint16_t kChecksumBytes = P::kChecksum == Checksum::kNone ? 0 : 1;

  static_assert(P::kNodeBits >= 1 && P::kNodeBits <= 16, "node ids have 1 to 16 bits");
  static_assert(P::kMessageBits >= 1 && P::kMessageBits <= 32, "message numbers have 1 to 32 bits");
  static_assert(P::kSequenceBits <= 15, "sequence numbers have at most 15 bits");
  static_assert(P::kChannelBits >= 1 && P::kChannelBits <= 16, "channels have 1 to 16 bits");
  static_assert(P::kTtlBits <= 8 && P::kHopsBits <= 8, "TTL and hops have at most 8 bits");
  static_assert(P::kSizeBits <= 16 && P::kEpochBits <= 16, "size and epoch have at most 16 bits");
  static_assert(P::kTimestampedBits <= 1 && P::kGatewayBits <= 1, "flags have one bit");
  static_assert(P::kTimestampBits <= 32, "a timestamp has at most 32 bits");
  static_assert(P::kMtuBytes > kHeaderBytes + kChecksumBytes,
                "this profile leaves no payload: its header and checksum fill the whole packet");
  static_assert(P::kTimestampBits == 0 ||
                    P::kMtuBytes > kHeaderBytes + kChecksumBytes + kTimestampBytes,
                "this profile leaves no payload on timestamped channels: shorten the timestamp");
  static_assert(!P::kPadded || P::kSizeBits == 0,
                "a size field needs packets that keep their length: set kPadded to false");
  static_assert(P::kTimestampBits >= 1 ||
                    (P::kTimestampedBits == 0 && P::kTimestampedFrom > low_bits(P::kChannelBits)),
                "timestamped channels need a timestamp: raise kTimestampBits");
  static_assert(P::kMtuBytes <= UINT32_C(65535), "a packet has at most 65535 bytes");
  static_assert(P::kSizeBits != 0 || P::kMaxMessageBytes <= UINT32_C(65535) ||
                    static_cast<uint64_t>(P::kMtuBytes - kHeaderBytes - kChecksumBytes)
                            << P::kSequenceBits <=
                        UINT32_C(65535),
                "a message of as many packets as kSequenceBits counts is longer than 65535 bytes: "
                "lower kMaxMessageBytes");
  static_assert(P::kMaxMessageBytes >= 1, "a message has at least a byte: raise kMaxMessageBytes");
  static_assert(P::kChannels >= 1, "a node has at least one channel");
  static_assert(P::kChannels <= 2000, "a node has at most 2000 channels at once: lower kChannels");
  static_assert(P::kPublishers >= 1 && P::kPublishers <= 255 && P::kSubscribers >= 1 &&
                    P::kSubscribers <= 255,
                "a channel has 1 to 255 publishers and 1 to 255 subscribers");
  static_assert(P::kFragmentSlots >= 1, "messages of several packets need a fragment slot");
  static_assert(P::kForwardSlots >= 1, "a node forwards: give it at least one forward slot");
  static_assert(P::kRecords >= 2, "a node remembers at least two messages");
  static_assert((P::kBuckets & (P::kBuckets - 1)) == 0 && P::kBuckets != 1,
                "the number of buckets is a power of 2, or 0 to look at all records");
  static_assert(P::kClockBits == 8 || P::kClockBits == 16 || P::kClockBits == 32,
                "the clock is counted in 8, 16 or 32 bits");
  static_assert(P::kAssemblyTicks >= 1,
                "fragments wait at least a tick for the others: raise kAssemblyTicks");
  static_assert(P::kAssemblyTicks <= low_bits(P::kClockBits) / 2,
                "fragments would outlive the clock: shorten kAssemblyTicks or raise kClockBits");
  static_assert(P::kFloodTicks <= low_bits(P::kClockBits) / 2,
                "records would outlive the clock: shorten kFloodTicks or raise kClockBits");
  static_assert(P::kOneHopDuplicateTicks <= P::kFloodSurelyTicks &&
                    P::kFloodSurelyTicks <= P::kFloodTicks,
                "a flooded message is remembered at least as long as a one-hop message");
  static constexpr bool kIsSound = true;
};

}  // namespace core
}  // namespace swarmtalk
