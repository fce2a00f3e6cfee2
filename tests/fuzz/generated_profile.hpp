// Profiles drawn from a number at compile time: widths, lengths, memory and times of every legal
// kind, the narrow and the odd ones more often than their share. Used by fuzz_core_profiles.
#pragma once

#include <cstddef>
#include <cstdint>

#include "swarmtalk/profile.hpp"
#include "swarmtalk/sensing.hpp"

namespace swarmtalk::core::fuzz {

/// A number that depends on all bits of `seed` and `what`.
constexpr uint32_t mixed(uint32_t seed, uint32_t what) {
  uint32_t hash = seed * UINT32_C(0x9E3779B1) ^ what * UINT32_C(0x85EBCA6B);
  for (int round = 0; round < 3; ++round) {
    hash ^= hash >> 15;
    hash *= UINT32_C(0x2C1B3C6D);
    hash ^= hash >> 13;
  }
  return hash;
}
constexpr uint32_t least(uint32_t a, uint32_t b) {
  return a < b ? a : b;
}

template <uint32_t kSeed>
struct Generated : ProfileDefaults {
 private:
  template <size_t kCount>
  static constexpr uint32_t one_of(uint32_t what, const uint32_t (&choices)[kCount]) {
    return choices[mixed(kSeed, what) % kCount];
  }
  static constexpr bool coin(uint32_t what) { return mixed(kSeed, what) % 2 != 0; }
  static constexpr uint32_t between(uint32_t what, uint32_t low, uint32_t high) {
    return low + mixed(kSeed, what) % (high - low + 1);
  }
  enum Marks { kUnmarked, kFlag, kNumber };
  static constexpr uint32_t kMarks = between(0, kUnmarked, kNumber);
  /// Draws are made by these, so that no two members have one.
  enum What : uint32_t {
    kForNode = 1,
    kForMessage,
    kForSequence,
    kForChannel,
    kForTtl,
    kForHops,
    kForSize,
    kForEpoch,
    kForGateway,
    kForTimestamp,
    kForFrom,
    kForChecksum,
    kForPadding,
    kForPayload,
    kForLimit,
    kForLimited,
    kForChannels,
    kForPublishers,
    kForSubscribers,
    kForForward,
    kForFragments,
    kForRecords,
    kForBuckets,
    kForRepeats,
    kForClock,
    kForAssembly,
    kForOneHop,
    kForSurely,
    kForFlood,
    kForCounter,
    kForHopsFromTtl
  };

 public:
  using Sensing = DistanceSensing;
  static constexpr uint8_t kNodeBits = one_of(kForNode, {1, 2, 3, 4, 7, 8, 9, 16});
  static constexpr uint8_t kMessageBits = one_of(kForMessage, {1, 2, 3, 4, 5, 8, 13, 16, 17, 32});
  static constexpr uint8_t kSequenceBits = one_of(kForSequence, {0, 1, 2, 3, 3, 4, 5, 6, 9, 15});
  static constexpr uint8_t kChannelBits = one_of(kForChannel, {1, 2, 4, 5, 8, 11, 16});
  static constexpr uint8_t kTtlBits = one_of(kForTtl, {0, 1, 3, 4, 5, 8});
  static constexpr uint8_t kHopsBits = one_of(kForHops, {0, 0, 1, 3, 8});
  static constexpr bool kPadded = mixed(kSeed, kForPadding) % 5 < 2;
  static constexpr uint8_t kSizeBits =
      kPadded ? 0 : one_of(kForSize, {0, 0, 3, 5, 6, 8, 9, 13, 16});
  static constexpr uint8_t kEpochBits = one_of(kForEpoch, {0, 0, 1, 7, 16});
  static constexpr uint8_t kGatewayBits = coin(kForGateway);
  static constexpr uint8_t kTimestampBits =
      one_of(kForTimestamp, {0, 1, 7, 8, 9, 13, 16, 20, 24, 31, 32, 32});
  static constexpr uint8_t kTimestampedBits = kTimestampBits != 0 && kMarks == kFlag;
  static constexpr uint32_t kTimestampedFrom =
      kTimestampBits != 0 && kMarks == kNumber
          ? between(kForFrom, 1, least(low_bits(kChannelBits), 6))
          : kNoTimestampedChannels;
  static constexpr Checksum kChecksum = static_cast<Checksum>(one_of(kForChecksum, {0, 0, 1, 2}));
  static constexpr bool kHopsFromTtl = coin(kForHopsFromTtl);

 private:
  static constexpr uint32_t kTimedPayload = one_of(kForPayload, {1, 1, 2, 3, 4, 5, 8, 13, 60, 253});
  static constexpr uint32_t kPayload = kTimedPayload + (kTimestampBits + 7) / 8;
  static constexpr uint32_t kAroundPayload =
      (kNodeBits + kMessageBits + kSequenceBits + 1 + kChannelBits + kTtlBits + kHopsBits +
       kSizeBits + kEpochBits + kTimestampedBits + kGatewayBits + 7) /
          8 +
      (kChecksum == Checksum::kNone ? 0 : 1);
  /// So that a message has no more than 32 packets, with timestamps or without.
  static constexpr uint32_t kMostBytes = kTimedPayload * 32;
  static constexpr bool kMustLimit = kSequenceBits > 5 && low_bits(kSizeBits) - 1 >= kMostBytes;

 public:
  static constexpr uint16_t kMtuBytes = static_cast<uint16_t>(kAroundPayload + kPayload);
  static constexpr uint32_t kMaxMessageBytes =
      kMustLimit || mixed(kSeed, kForLimited) % 3 != 0
          ? one_of(kForLimit,
                   {1, kPayload + 1, 4 * kTimedPayload, kMostBytes,
                    between(kForLimit, 1, kMostBytes), between(kForLimit, 1, kMostBytes)})
          : UINT32_C(0xFFFFFFFF);

  static constexpr uint16_t kChannels = one_of(kForChannels, {1, 2, 5, 20});
  static constexpr uint8_t kPublishers = one_of(kForPublishers, {1, 1, 3, 10});
  static constexpr uint8_t kSubscribers = one_of(kForSubscribers, {1, 2, 16});
  static constexpr uint16_t kForwardSlots = one_of(kForForward, {1, 2, 10, 255, 256});
  static constexpr uint16_t kFragmentSlots = one_of(kForFragments, {1, 2, 7, 40, 255, 256});
  static constexpr uint16_t kRecords = one_of(kForRecords, {2, 3, 20, 255, 256});
  static constexpr uint16_t kBuckets = one_of(kForBuckets, {0, 0, 2, 16, 512});
  static constexpr uint8_t kForwardRepeats = one_of(kForRepeats, {0, 0, 0, 1, 3});
  static constexpr uint32_t kBufferBudgetBytes = UINT32_C(1) << 24;
  using Counter = UintFor<(8 << mixed(kSeed, kForCounter) % 4)>;

  static constexpr uint8_t kClockBits = one_of(kForClock, {8, 16, 16, 32});

 private:
  static constexpr uint32_t kMostTicks = low_bits(static_cast<uint8_t>(kClockBits - 1));

 public:
  static constexpr uint32_t kAssemblyTicks =
      least(one_of(kForAssembly, {1, 6, 100, 127, 2000}), kMostTicks);
  static constexpr uint32_t kOneHopDuplicateTicks =
      least(one_of(kForOneHop, {0, 1, 8, 127, 1000}), kMostTicks);
  static constexpr uint32_t kFloodSurelyTicks =
      least(kOneHopDuplicateTicks + one_of(kForSurely, {0, 1, 64, 1000}), kMostTicks);
  static constexpr uint32_t kFloodTicks =
      least(kFloodSurelyTicks + one_of(kForFlood, {0, 100, 1000, 20000}), kMostTicks);
};

}  // namespace swarmtalk::core::fuzz
