// One message whose packets come with timestamps and without. With one there is room for less, so
// the same place begins at another byte, and a size stands for another count of packets. Nobody
// honest sends that; one forged packet does.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/support/profiles.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::TestNode;

/// Packet `place` of a message of `size` bytes, right in itself.
template <class P>
Bytes packet_of(uint16_t size, uint16_t place, bool timestamped, uint8_t channel) {
  using W = Wire<P>;
  const uint16_t payload = timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes;
  typename W::Header header = {};
  header.node = 5;
  header.message = 3;
  header.channel = channel;
  header.sequence = static_cast<typename W::Sequence>(place);
  header.end = place + 1 == W::packets_for(size, payload);
  header.size = static_cast<decltype(header.size)>(size);
  header.has_delay = timestamped;
  Bytes packet(W::kMtuBytes, static_cast<uint8_t>(place));
  W::encode(header, packet.data());
  size_t body = header.end ? size - place * payload : payload;
  if (timestamped) body += W::kTimestampBytes;
  const size_t bare = P::kPadded ? packet.size() - W::kChecksumBytes : W::kHeaderBytes + body;
  packet.resize(W::seal(packet.data(), static_cast<typename W::PacketSize>(bare)));
  return packet;
}

/// All packets of a message but one, then that one as if the message were of the other kind.
/// @return what was delivered
template <class P>
size_t hear_mixed(uint16_t size, bool timestamped, uint16_t strange) {
  using W = Wire<P>;
  const uint16_t payload = timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes;
  const uint16_t packets = W::packets_for(size, payload);
  auto node = std::make_unique<TestNode<P>>(1);
  node->open(1, 0, timestamped);
  for (uint16_t n = packets; n-- > 0;) {
    if (n == strange) continue;
    EXPECT_EQ(node->hear(packet_of<P>(size, n, timestamped, 1)), Error::kOk);
  }
  node->hear(packet_of<P>(size, strange, !timestamped, 1));
  EXPECT_EQ(node->node.counters().contradictions, 1u) << size << " bytes, packet " << strange;
  return node->received.size();
}

TEST(MixedTimestamps, OfAWifiMessageAreAContradiction) {
  using W = Wire<Wifi>;
  // 12 packets with timestamps, 11 without.
  for (uint16_t size = 11 * W::kTimedPayloadBytes + 1; size <= 11 * W::kPayloadBytes; ++size) {
    EXPECT_EQ(hear_mixed<Wifi>(size, true, 1), 0u);
    EXPECT_EQ(hear_mixed<Wifi>(size, true, 0), 0u);
  }
  // 3 of either kind.
  EXPECT_EQ(hear_mixed<Wifi>(4000, true, 1), 0u);
  EXPECT_EQ(hear_mixed<Wifi>(4000, false, 1), 0u);
}

/// The `wifi` profile's fields around a few bytes, without buckets and with: packets then take
/// other ways.
template <uint16_t kWithBuckets>
struct SmallWifi : Wifi {
  static constexpr uint16_t kMtuBytes = 26;
  static constexpr uint16_t kBuckets = kWithBuckets;
  static constexpr uint16_t kRecords = 20;
  static constexpr uint32_t kMaxMessageBytes = 120;
};
template <class P>
class MixedTimestampsOf : public ::testing::Test {};
using SmallProfiles = ::testing::Types<SmallWifi<0>, SmallWifi<16>>;
TYPED_TEST_SUITE(MixedTimestampsOf, SmallProfiles);

TYPED_TEST(MixedTimestampsOf, AnySizeAreAContradiction) {
  using W = Wire<TypeParam>;
  for (uint16_t size = W::kPayloadBytes + 1; size <= W::kMessageBytes; ++size) {
    for (bool timestamped : {false, true}) {
      const uint16_t payload = timestamped ? W::kTimedPayloadBytes : W::kPayloadBytes;
      const uint16_t others = timestamped ? W::kPayloadBytes : W::kTimedPayloadBytes;
      const uint16_t count = std::min(W::packets_for(size, payload), W::packets_for(size, others));
      for (uint16_t strange = 0; strange < count; ++strange) {
        EXPECT_EQ(hear_mixed<TypeParam>(size, timestamped, strange), 0u);
      }
    }
  }
}

TYPED_TEST(MixedTimestampsOf, AMessageInOrderAreAContradictionToo) {
  using W = Wire<TypeParam>;
  const uint16_t size = 3 * W::kTimedPayloadBytes;
  TestNode<TypeParam> node(1);
  node.open(1, 0, true);
  node.hear(packet_of<TypeParam>(size, 0, false, 1));
  node.hear(packet_of<TypeParam>(size, 1, true, 1));
  node.hear(packet_of<TypeParam>(size, 2, true, 1));
  EXPECT_TRUE(node.received.empty());
}

TEST(MixedTimestamps, OfAChannelOpenedAnewAreAContradiction) {
  using P = testing::ShortUnmarked;  // with a timestamp, places up to 7 are right
  TestNode<P> node(1);
  Channel<P>* channel = node.open(1, 0, true);
  for (uint16_t place = 1; place < 7; ++place) {
    EXPECT_EQ(node.hear(packet_of<P>(7, place, true, 1)), Error::kOk);
  }
  node.node.remove_channel(channel);
  node.open(1, 0, false);
  node.hear(packet_of<P>(10, 0, false, 1));
  EXPECT_TRUE(node.received.empty());
  EXPECT_EQ(node.node.counters().contradictions, 1u);
}

}  // namespace
}  // namespace swarmtalk::core
