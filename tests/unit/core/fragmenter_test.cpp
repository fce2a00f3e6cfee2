#include "swarmtalk/fragmenter.hpp"

#include <gtest/gtest.h>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;

/// The packets of one message, on a channel with or without timestamps, all pulled at `pulled_at`.
template <class P>
std::vector<Bytes> cut(const Bytes& message, bool timestamped = false, uint16_t loaded_at = 0,
                       uint16_t pulled_at = 0) {
  Fragmenter<P> sut;
  typename Wire<P>::Header header = {};
  header.message = 1;
  header.channel = 9;
  header.has_delay = timestamped;
  sut.reset(header);
  EXPECT_FALSE(sut.is_busy());
  sut.load(message.data(), static_cast<uint16_t>(message.size()), 3, false, loaded_at);
  std::vector<Bytes> packets;
  EXPECT_EQ(sut.number(), 2u);
  while (sut.is_busy()) {
    EXPECT_EQ(sut.is_untouched(), packets.empty());
    if (sut.is_untouched()) sut.set_sender(5, 0);
    Bytes packet(P::kMtuBytes + 1u, 0xEE);
    const auto size = sut.next(timestamped, pulled_at, packet.data());
    EXPECT_EQ(packet[size], 0xEE) << "nothing is written behind a packet";
    packet.resize(size);
    packets.push_back(packet);
    EXPECT_LE(packets.size(), Wire<P>::kMaxPackets);
  }
  return packets;
}

TEST(Fragmenter, CutsAtFullPackets) {
  EXPECT_EQ(cut<Kilobot>(pattern(1)).size(), 1u);
  EXPECT_EQ(cut<Kilobot>(pattern(5)).size(), 1u);
  EXPECT_EQ(cut<Kilobot>(pattern(6)).size(), 2u);
  EXPECT_EQ(cut<Kilobot>(pattern(40)).size(), 8u);
}

TEST(Fragmenter, NumbersPacketsFromZeroAndMarksTheLastAlone) {
  const auto packets = cut<Kilobot>(pattern(40));
  for (uint8_t i = 0; i < 8; ++i) {
    const auto header = Wire<Kilobot>::decode(packets[i].data());
    EXPECT_EQ(header.node, 5);
    EXPECT_EQ(header.message, 2);
    EXPECT_EQ(header.channel, 9);
    EXPECT_EQ(header.sequence, i);
    EXPECT_EQ(header.end, i == 7);
    EXPECT_EQ(header.ttl, 3);
    EXPECT_EQ(Wire<Kilobot>::check(packets[i].data(), 9), Error::kOk);
  }
}

TEST(Fragmenter, FillsTheLastPacketWithZerosWherePacketsArePadded) {
  const auto packets = cut<Kilobot>(Bytes(6, 0xAA));
  EXPECT_EQ(Bytes(packets[1].begin() + 3, packets[1].end() - 1), (Bytes{0xAA, 0, 0, 0, 0}));
}

TEST(Fragmenter, GivesEachPacketTheTimeUntilItsOwnPull) {
  const auto packets = cut<Kilobot>(pattern(4), true, 65000, 500);
  ASSERT_EQ(packets.size(), 2u) << "three bytes beside a timestamp of two";
  for (const Bytes& packet : packets) {
    EXPECT_EQ(Wire<Kilobot>::timestamp(packet.data() + 3, 5), 1036) << "across a wrap";
  }
}

TEST(Fragmenter, TellsTheExactSizeInEveryWifiPacket) {
  constexpr uint16_t kRoom = Wire<Wifi>::kPayloadBytes;
  EXPECT_EQ(cut<Wifi>({}).at(0).size(), Wire<Wifi>::kHeaderBytes);
  EXPECT_EQ(cut<Wifi>(pattern(kRoom)).size(), 1u);
  const auto packets = cut<Wifi>(pattern(kRoom + 1u));
  ASSERT_EQ(packets.size(), 2u);
  EXPECT_EQ(packets[0].size(), Wifi::kMtuBytes);
  EXPECT_EQ(packets[1].size(), Wire<Wifi>::kHeaderBytes + 1u);
  for (const Bytes& packet : packets) {
    EXPECT_EQ(Wire<Wifi>::decode(packet.data()).size, kRoom + 1);
  }
}

TEST(Fragmenter, KeepsACopyOfTheMessage) {
  Fragmenter<Kilobot> sut;
  sut.reset({});
  Bytes message = {1, 2, 3, 4, 5};
  sut.load(message.data(), 5, 0, false, 0);
  message.assign(5, 0xFF);
  uint8_t packet[9];
  sut.next(false, 0, packet);
  EXPECT_EQ(Bytes(packet + 3, packet + 8), (Bytes{1, 2, 3, 4, 5}));
}

}  // namespace
}  // namespace swarmtalk::core
