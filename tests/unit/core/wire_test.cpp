#include "swarmtalk/wire.hpp"

#include <gtest/gtest.h>

#include <cstring>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::core {
namespace {

TEST(Wire, HasTheSizesOnPaper) {
  EXPECT_EQ(Wire<Kilobot>::kHeaderBytes, 3);
  EXPECT_EQ(Wire<Kilobot>::kPayloadBytes, 5);
  EXPECT_EQ(Wire<Kilobot>::kTimedPayloadBytes, 3);
  EXPECT_EQ(Wire<Kilobot>::kMessageBytes, 40);
  EXPECT_EQ(Wire<Wifi>::kHeaderBytes, 17);
  EXPECT_EQ(Wire<Wifi>::kMessageBytes, 16384);
  EXPECT_EQ(Wire<Wifi>::kMaxPackets, 12);
  EXPECT_EQ(Wire<Footbot>::kPayloadBytes, 5);
}

TEST(Wire, WritesTheWifiHeaderAsOneBigEndianString) {
  Wire<Wifi>::Header header = {};
  header.node = 0x0102;
  header.message = 0x03040506;
  header.sequence = 0x0708;
  header.end = true;
  header.channel = 0x090A;
  header.ttl = 0x0B;
  header.hops = 0x0C;
  header.size = 0x0D0E;
  header.epoch = 0x0F10;
  header.has_delay = true;
  header.crossed_gateway = true;
  uint8_t packet[17];
  Wire<Wifi>::encode(header, packet);
  const uint8_t expected[17] = {1,    2,    3,    4,    5,    6,    0x0E, 0x11, 9,
                                0x0A, 0x0B, 0x0C, 0x0D, 0x0E, 0x0F, 0x10, 0xC0};
  EXPECT_EQ(memcmp(packet, expected, 17), 0);
}

TEST(Wire, CountsAHopAndKeepsTheRest) {
  Wire<Wifi>::Header header = {};
  header.ttl = 5;
  header.hops = 254;
  uint8_t packet[17];
  Wire<Wifi>::encode(header, packet);
  Wire<Wifi>::count_hop(packet, header);
  header = Wire<Wifi>::decode(packet);
  EXPECT_EQ(header.ttl, 4);
  EXPECT_EQ(header.hops, 255);
  Wire<Wifi>::count_hop(packet, header);
  EXPECT_EQ(Wire<Wifi>::decode(packet).hops, 255) << "stays at its largest value";
}

TEST(Wire, SaturatesDelays) {
  EXPECT_EQ(Wire<Kilobot>::later(65000, 500), 65500);
  EXPECT_EQ(Wire<Kilobot>::later(65000, 535), 65535);
  EXPECT_EQ(Wire<Kilobot>::later(65000, 60000), 65535);
  EXPECT_EQ(Wire<Kilobot>::later(65535, 0), 65535);
}

TEST(Wire, RefusesWrongLengthsAndDamage) {
  uint8_t packet[9] = {1, 2, 3, 4, 5, 6, 7, 8, 36};
  EXPECT_EQ(Wire<Kilobot>::check(packet, 9), Error::kOk);
  EXPECT_EQ(Wire<Kilobot>::check(packet, 8), Error::kBadPacket);
  packet[4] ^= 1;
  EXPECT_EQ(Wire<Kilobot>::check(packet, 9), Error::kBadChecksum);
  EXPECT_EQ(Wire<Wifi>::check(packet, 16), Error::kBadPacket);
}

}  // namespace
}  // namespace swarmtalk::core
