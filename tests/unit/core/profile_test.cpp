// Profiles at the edges of what is possible work; those beyond do not compile (CMakeLists.txt,
// impossible_profile.cpp).
#include "swarmtalk/profile.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/sensing.hpp"
#include "tests/support/profiles.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using testing::TestNode;
using testing::WideFields;

/// One byte of payload, one packet a message, two ids, nobody forwards.
struct Smallest : ProfileDefaults {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 2;
  static constexpr uint8_t kNodeBits = 2;
  static constexpr uint8_t kMessageBits = 1;
  static constexpr uint8_t kSequenceBits = 0;
  static constexpr uint8_t kChannelBits = 1;
  static constexpr uint8_t kTtlBits = 0;
  static constexpr uint8_t kTimestampBits = 0;
  static constexpr uint16_t kChannels = 1;
  static constexpr uint16_t kForwardSlots = 1;
  static constexpr uint16_t kRecords = 2;
};

TEST(Profile, OfOneByteOfPayloadWorks) {
  TestNode<Smallest> a(1);
  TestNode<Smallest> b(2);
  a.open(1);
  b.open(1);
  const uint8_t byte = 0x5A;
  ASSERT_EQ(a.publisher->send(&byte, 1), Error::kOk);
  EXPECT_EQ(a.publisher->send(&byte, 2), Error::kTooLong);
  const Bytes packet = a.pull();
  EXPECT_EQ(packet, (Bytes{0x78, 0x5A})) << "node 01, message 1, end 1, channel 1";
  b.hear(packet);
  ASSERT_EQ(b.received.size(), 1u);
  EXPECT_EQ(b.received[0].bytes, Bytes{0x5A});
}

struct Widest : WideFields {
  using Sensing = DistanceSensing;
  static constexpr uint16_t kMtuBytes = 40;
  static constexpr Checksum kChecksum = Checksum::kCrc8;
  static constexpr uint32_t kMaxMessageBytes = 500;
  static constexpr uint16_t kForwardSlots = 32;
  static constexpr uint32_t kBufferBudgetBytes = 1u << 16;
};

TEST(Profile, OfTheWidestFieldsWorks) {
  TestNode<Widest> a(0xFFFE);
  TestNode<Widest> b(2);
  a.node.set_epoch(0xFFFF);
  ASSERT_NE(a.open(0xFFFF, 255, true), nullptr);
  b.open(0xFFFF, 255, true);
  const Bytes message = pattern(500);
  ASSERT_EQ(a.publisher->send(message.data(), 500), Error::kOk);
  const auto packets = a.pull_all();
  EXPECT_EQ(packets.size(), 28u) << "18 bytes of payload each";
  for (const Bytes& packet : packets) ASSERT_EQ(b.hear(packet), Error::kOk);
  ASSERT_EQ(b.received.size(), 1u);
  EXPECT_EQ(b.received[0].bytes, message);
  EXPECT_EQ(b.received[0].reception.node, 0xFFFE);
  EXPECT_EQ(b.received[0].reception.epoch, 0xFFFF);
  EXPECT_EQ(b.pull_all().size(), 28u) << "forwarded";
}

/// Repeats: every forwarded packet leaves three times, our own once.
struct Repeating : Smallest {
  static constexpr uint16_t kMtuBytes = 9;
  static constexpr uint8_t kTtlBits = 4;
  static constexpr uint8_t kForwardRepeats = 2;
};

TEST(Profile, RepeatsForwardedPacketsAsOftenAsItSays) {
  TestNode<Repeating> origin(1);
  TestNode<Repeating> forwarder(2);
  origin.open(0, 3);
  origin.publisher->send(pattern(5).data(), 5);
  const auto sent = origin.pull_all();
  ASSERT_EQ(sent.size(), 1u);
  forwarder.hear(sent[0]);
  const auto repeated = forwarder.pull_all();
  ASSERT_EQ(repeated.size(), 3u);
  EXPECT_EQ(repeated[0], repeated[1]);
  EXPECT_EQ(repeated[0], repeated[2]);
  forwarder.hear(sent[0]);
  EXPECT_TRUE(forwarder.pull_all().empty());
}

}  // namespace
}  // namespace swarmtalk::core
