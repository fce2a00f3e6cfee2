// Profiles of a user's own, with packets that nobody honest sends: a packet claims a place behind
// what a buffer holds, or has less than its channel says. Run under the sanitizers too, which see
// what a count does not.
#include <gtest/gtest.h>

#include <set>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/support/profiles.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::ShortUnmarked;
using testing::TestNode;
using testing::UnmarkedLengths;

/// A packet as the wire of P has it, sealed. @param bytes  payload and timestamp
template <class P>
Bytes forge(const typename Wire<P>::Header& header, const Bytes& bytes) {
  Bytes packet(Wire<P>::kMtuBytes);
  Wire<P>::encode(header, packet.data());
  std::copy(bytes.begin(), bytes.end(), packet.begin() + Wire<P>::kHeaderBytes);
  const size_t bare =
      P::kPadded ? packet.size() - Wire<P>::kChecksumBytes : Wire<P>::kHeaderBytes + bytes.size();
  packet.resize(Wire<P>::seal(packet.data(), static_cast<typename Wire<P>::PacketSize>(bare)));
  return packet;
}

template <class P>
typename Wire<P>::Header header_of(uint16_t sequence, bool end, uint16_t channel) {
  typename Wire<P>::Header header = {};
  header.node = 5;
  header.message = 3;
  header.sequence = static_cast<typename Wire<P>::Sequence>(sequence);
  header.end = end;
  header.channel = static_cast<typename Wire<P>::ChannelId>(channel);
  return header;
}

// --- places behind the longest message --------------------------------------------------------

template <uint32_t kBytes>
struct ShortKilobot : Kilobot {
  static constexpr uint32_t kMaxMessageBytes = kBytes;
};
/// With a table of buckets.
template <class Base>
struct WithBuckets : Base {
  static constexpr uint16_t kBuckets = 8;
};
template <uint32_t kBytes>
struct ShortFootbot : Footbot {
  static constexpr uint32_t kMaxMessageBytes = kBytes;
};
/// Seven packets of 9000 bytes are the most that 65535 bytes hold.
struct Large : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 9003;
  static constexpr uint32_t kTimestampedFrom = 8;
  static constexpr uint32_t kMaxMessageBytes = 65535;
  static constexpr uint32_t kBufferBudgetBytes = UINT32_C(1) << 20;
};

template <class P>
class HostilePlaces : public ::testing::Test {};
using PlaceProfiles = ::testing::Types<ShortKilobot<1>, ShortKilobot<20>, ShortKilobot<32>,
                                       WithBuckets<ShortKilobot<32>>, ShortFootbot<20>,
                                       ShortFootbot<32>, ShortUnmarked, Large>;
TYPED_TEST_SUITE(HostilePlaces, PlaceProfiles);

/// All packets that the sequence number can count, full, the last one the end, in an order.
template <class P>
void hear_the_longest(bool timestamped, bool reversed) {
  using W = Wire<P>;
  const uint16_t channel = timestamped ? 8 : 1;
  const size_t payload = timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes;
  const uint16_t limit = timestamped ? W::kTimedMessageBytes : W::kMessageBytes;
  constexpr uint16_t kPlaces = 1 << P::kSequenceBits;
  for (uint16_t end = 0; end < kPlaces; ++end) {
    TestNode<P> node(1);
    node.open(channel, 0, timestamped);
    for (uint16_t n = 0; n <= end; ++n) {
      const uint16_t place = reversed ? static_cast<uint16_t>(end - n) : n;
      const Bytes body = pattern(payload + (timestamped ? W::kTimestampBytes : 0));
      const size_t behind = (place + 1u) * payload;
      const bool fits = place == end ? behind <= limit : behind < limit;
      EXPECT_EQ(node.hear(forge<P>(header_of<P>(place, place == end, channel), body)),
                fits ? Error::kOk : Error::kBadPacket)
          << "place " << place << " of " << end;
    }
    const bool fits = (end + 1u) * payload <= limit;
    ASSERT_EQ(node.received.size(), fits ? 1u : 0u) << "last place " << end;
    if (fits) {
      EXPECT_EQ(node.received[0].bytes.size(), (end + 1u) * payload);
    }
  }
}

TYPED_TEST(HostilePlaces, BehindTheLongestMessageAreRefused) {
  for (bool reversed : {false, true}) {
    hear_the_longest<TypeParam>(false, reversed);
    hear_the_longest<TypeParam>(true, reversed);
  }
}

TYPED_TEST(HostilePlaces, LeaveRoomForWhatTheProfilePromises) {
  using W = Wire<TypeParam>;
  EXPECT_LE(W::kTimedMessageBytes, +W::kMessageBytes) << "a buffer of the second holds the first";
  for (bool timestamped : {false, true}) {
    const uint16_t longest = timestamped ? W::kTimedMessageBytes : W::kMessageBytes;
    const size_t payload = timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes;
    for (const size_t size : {size_t{1}, payload, size_t{longest} - 1, size_t{longest}}) {
      if (size == 0 || size > longest) continue;
      TestNode<TypeParam> sender(1);
      TestNode<TypeParam> receiver(2);
      ASSERT_NE(sender.open(timestamped ? 8 : 1, 0, timestamped), nullptr);
      receiver.open(timestamped ? 8 : 1, 0, timestamped);
      const Bytes message = pattern(size);
      ASSERT_EQ(sender.publisher->send(message.data(), longest + 1), Error::kTooLong);
      ASSERT_EQ(sender.publisher->send(message.data(), static_cast<uint16_t>(size)), Error::kOk);
      for (const Bytes& packet : sender.pull_all()) ASSERT_EQ(receiver.hear(packet), Error::kOk);
      ASSERT_EQ(receiver.received.size(), 1u) << size << " bytes";
      Bytes heard = receiver.received[0].bytes;
      EXPECT_LE(heard.size(), longest);
      heard.resize(size);
      EXPECT_EQ(heard, message);
    }
  }
}

TEST(HostileProfiles, HoldWhatTheySayUpToTheEndOfAPacket) {
  EXPECT_EQ(Wire<ShortKilobot<1>>::kMessageBytes, 5) << "a packet is padded";
  EXPECT_EQ(Wire<ShortKilobot<20>>::kTimedMessageBytes, 21) << "seven packets of three";
  EXPECT_EQ(Wire<ShortKilobot<20>>::kMessageBytes, 25) << "which has to fit";
  EXPECT_EQ(Wire<ShortKilobot<32>>::kMessageBytes, 35);
  EXPECT_EQ(Wire<ShortFootbot<32>>::kMessageBytes, 32) << "lengths are exact";
  EXPECT_EQ(Wire<ShortFootbot<32>>::kTimedMessageBytes, 24) << "eight packets of three";
  EXPECT_EQ(Wire<Large>::kMessageBytes, 63000);
  EXPECT_EQ(Wire<Large>::kTimedMessageBytes, 62986);
}

TEST(HostileProfiles, RefuseTheByteBehindTheLongestMessage) {
  using P = ShortFootbot<32>;
  for (const size_t bytes : {2u, 3u}) {
    TestNode<P> node(1);
    node.open(1);
    for (uint16_t place = 0; place < 6; ++place) {
      node.hear(forge<P>(header_of<P>(place, false, 1), pattern(5)));
    }
    EXPECT_EQ(node.hear(forge<P>(header_of<P>(6, true, 1), pattern(bytes))),
              bytes == 2 ? Error::kOk : Error::kBadPacket);
    EXPECT_EQ(node.received.size(), bytes == 2 ? 1u : 0u);
  }
}

TEST(HostileProfiles, SendOnWhatOnlyTheChannelsOwnersCanJudge) {
  // Where timestamps are not marked, a robot without the channel does not know which limit holds.
  using P = ShortUnmarked;
  TestNode<P> origin(1);
  TestNode<P> forwarder(2);
  origin.open(9, 1, true);
  ASSERT_EQ(Wire<P>::kTimedMessageBytes, 7);
  ASSERT_EQ(origin.publisher->send(pattern(7).data(), 7), Error::kOk);
  for (const Bytes& packet : origin.pull_all()) EXPECT_EQ(forwarder.hear(packet), Error::kOk);
  EXPECT_EQ(forwarder.pull_all().size(), 7u) << "two are all that an untimed one may have";
}

/// A size in each packet, and timestamps that nothing marks.
struct SizedUnmarked : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 12;
  static constexpr uint8_t kSizeBits = 8;
  static constexpr bool kPadded = false;
};

TEST(HostileProfiles, SendOnTimestampedPacketsThatTheyCannotKnowForSuch) {
  TestNode<SizedUnmarked> origin(1);
  TestNode<SizedUnmarked> forwarder(2);
  TestNode<SizedUnmarked> receiver(3);
  origin.open(9, 1, true);
  receiver.open(9, 1, true);
  ASSERT_EQ(origin.publisher->send(pattern(40).data(), 40), Error::kOk);
  for (const Bytes& packet : origin.pull_all()) EXPECT_EQ(forwarder.hear(packet), Error::kOk);
  for (const Bytes& packet : forwarder.pull_all()) EXPECT_EQ(receiver.hear(packet), Error::kOk);
  ASSERT_EQ(receiver.received.size(), 1u);
  EXPECT_EQ(receiver.received[0].bytes, pattern(40));
}

// --- timestamps where there is no room for one -------------------------------------------------

/// UnmarkedLengths with timestamps of 2 bytes, and a checksum.
struct UnmarkedShortTimestamps : UnmarkedLengths {
  static constexpr Checksum kChecksum = Checksum::kCrc8;
  static constexpr uint8_t kTimestampBits = 13;
};

template <class P>
class HostileTimestamps : public ::testing::Test {};
using TimestampProfiles = ::testing::Types<UnmarkedLengths, UnmarkedShortTimestamps>;
TYPED_TEST_SUITE(HostileTimestamps, TimestampProfiles);

TYPED_TEST(HostileTimestamps, AreNotWrittenOverAPacketThatWaitedForItsChannel) {
  using P = TypeParam;
  using W = Wire<P>;
  for (size_t body = 0; body <= W::kBodyBytes; ++body) {
    TestNode<P> node(1);
    typename W::Header header = header_of<P>(0, true, 9);
    header.ttl = 2;
    const Bytes bytes(body, 0);
    const Bytes heard = forge<P>(header, bytes);
    ASSERT_EQ(node.hear(heard), Error::kOk);
    ASSERT_NE(node.open(9, 2, true), nullptr);
    node.port.now = 7;
    // What lies before and behind the packet is not the node's.
    Bytes out(W::kMtuBytes + 16u, 0xEE);
    ASSERT_EQ(node.node.pull_packet(out.data() + 8), heard.size());
    header.ttl = 1;
    Bytes waited = bytes;
    if (body >= W::kTimestampBytes) waited[body - W::kTimestampBytes] = 7;
    Bytes expected = forge<P>(header, waited);
    EXPECT_EQ(Bytes(out.begin() + 8, out.begin() + 8 + static_cast<long>(heard.size())), expected)
        << body << " bytes behind the header";
    EXPECT_EQ(Bytes(out.begin(), out.begin() + 8), Bytes(8, 0xEE));
  }
}

// --- numbers wider than their fields
// --------------------------------------------------------------

struct NarrowNames : Kilobot {
  static constexpr uint8_t kNodeBits = 4;
  static constexpr uint8_t kEpochBits = 3;
};

TEST(HostileProfiles, KnowTheirOwnPacketsByWhatFitsTheFields) {
  TestNode<NarrowNames> node(0x27);
  node.node.set_epoch(0xFB);
  node.open(1, 3);
  node.publisher->send(pattern(5).data(), 5);
  Bytes echo = node.pull();
  EXPECT_EQ(Wire<NarrowNames>::decode(echo.data()).node, 7);
  EXPECT_EQ(Wire<NarrowNames>::decode(echo.data()).epoch, 3);
  EXPECT_EQ(node.hear(echo), Error::kOk);
  EXPECT_TRUE(node.received.empty());
  EXPECT_EQ(node.node.counters().own_echoes, 1u);
  EXPECT_EQ(node.node.counters().id_collisions, 0u);
}

// --- tables at the edges of their indices
// ---------------------------------------------------------

template <uint16_t kSlots, uint16_t kWithBuckets>
struct ManySlots : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 9;
  static constexpr uint8_t kNodeBits = 16;
  static constexpr uint8_t kMessageBits = 16;
  static constexpr uint8_t kSequenceBits = 1;
  static constexpr uint16_t kForwardSlots = kSlots;
  static constexpr uint16_t kFragmentSlots = kSlots;
  static constexpr uint16_t kRecords = kSlots;
  static constexpr uint16_t kBuckets = kWithBuckets;
  static constexpr uint32_t kBufferBudgetBytes = UINT32_C(4) << 20;
  using Counter = uint32_t;
};

template <class P>
class HostileTables : public ::testing::Test {};
using TableProfiles = ::testing::Types<ManySlots<255, 0>, ManySlots<255, 256>, ManySlots<256, 0>,
                                       ManySlots<65535, 32768>>;
TYPED_TEST_SUITE(HostileTables, TableProfiles);

TYPED_TEST(HostileTables, AreFilledToTheLastPlaceAndEmptiedAgain) {
  using P = TypeParam;
  auto node = std::make_unique<TestNode<P>>(1);
  node->open(1, 3);
  for (uint16_t round = 0; round < 2; ++round) {
    std::set<std::pair<uint16_t, uint16_t>> heard;
    for (uint32_t n = 0; n <= P::kForwardSlots; ++n) {
      typename Wire<P>::Header header = header_of<P>(1, true, 1);
      header.node = static_cast<uint16_t>(2 + n % 60000);
      header.message = static_cast<uint16_t>(round + n / 60000 * 2);
      header.ttl = 1;
      heard.emplace(header.node, header.message);
      ASSERT_EQ(node->hear(forge<P>(header, {})), Error::kOk);
    }
    std::set<std::pair<uint16_t, uint16_t>> left;
    for (const Bytes& packet : node->pull_all()) {
      const auto header = Wire<P>::decode(packet.data());
      EXPECT_EQ(heard.count({header.node, header.message}), 1u);
      EXPECT_TRUE(left.emplace(header.node, header.message).second) << "sent on twice";
    }
    EXPECT_LE(left.size(), size_t{P::kForwardSlots});
    EXPECT_GE(left.size(), size_t{P::kForwardSlots} * (P::kBuckets == 0 ? 2 : 1) / 2);
    for (int step = 0; step < 45; ++step) {  // until all is forgotten
      node->port.now += 50;
      for (uint32_t n = 0; n < P::kRecords; ++n) EXPECT_TRUE(node->pull().empty());
    }
  }
  EXPECT_TRUE(node->received.empty()) << "of each message half is missing";
}

}  // namespace
}  // namespace swarmtalk::core
