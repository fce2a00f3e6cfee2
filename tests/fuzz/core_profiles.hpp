// The profiles of fuzz_core_profiles, in parts that are compiled beside each other: drawn ones, and
// some that are made to be hard. The parts' order is in the corpus: add at the end.
#pragma once

#include <cstddef>
#include <cstdint>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/support/profiles.hpp"

namespace swarmtalk::core::fuzz {

constexpr unsigned kParts = 4;
constexpr unsigned kDrawnInPart = 6;

/// Runs an input, without the byte that picked the part. Defined in core_profiles_part.cpp.
template <unsigned kPart>
void run_part(const uint8_t* bytes, size_t size);
extern template void run_part<0>(const uint8_t*, size_t);
extern template void run_part<1>(const uint8_t*, size_t);
extern template void run_part<2>(const uint8_t*, size_t);
extern template void run_part<3>(const uint8_t*, size_t);

/// Messages shorter than the sequence number counts, at the end of a packet and not; `Base` with
/// and without buckets, padded and not.
template <class Base, uint32_t kBytes, uint16_t kWithBuckets>
struct Shortened : Base {
  static constexpr uint32_t kMaxMessageBytes = kBytes;
  static constexpr uint16_t kBuckets = kWithBuckets;
  static constexpr uint16_t kRecords = 20;
  static constexpr uint16_t kFragmentSlots = 30;
};

/// Eight packets are longer than 16 bits count.
struct LongPackets : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 9000;
  static constexpr uint32_t kMaxMessageBytes = 65535;
  static constexpr uint32_t kBufferBudgetBytes = UINT32_C(1) << 20;
};

/// The `wifi` profile's fields around a few bytes, where sizes differ most.
template <uint16_t kWithBuckets>
struct SmallWifi : testing::WideFields {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 26;
  static constexpr uint32_t kMaxMessageBytes = 120;
  static constexpr uint16_t kBuckets = kWithBuckets;
};

}  // namespace swarmtalk::core::fuzz
