#include "kilobot_bridge/sent_packets.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::kilobot_bridge {
namespace {

IrData packet(unsigned number) {
  return {static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 8), 1};
}

TEST(SentPackets, AreKnownFromTheFirstToTheLastSixtyFour) {
  SentPackets sut;
  EXPECT_FALSE(sut.contains(IrData{})) << "nothing was sent";
  for (unsigned sent = 0; sent < 200; ++sent) {
    sut.remember(packet(sent));
    const unsigned oldest = sent < 64 ? 0 : sent - 63;
    for (unsigned number = oldest; number <= sent; ++number) {
      ASSERT_TRUE(sut.contains(packet(number))) << number << " of " << sent;
    }
    ASSERT_FALSE(sut.contains(packet(oldest - 1))) << sent;
    ASSERT_FALSE(sut.contains(packet(sent + 1)));
  }
}

TEST(SentPackets, AreKnownByTheirBeginning) {
  SentPackets sut;
  sut.remember({1, 2, 3, 4});
  EXPECT_TRUE(sut.contains(std::array<std::uint8_t, 2>{1, 2}));
  EXPECT_TRUE(sut.contains(std::array<std::uint8_t, 6>{1, 2, 3, 4, 0, 0}));
  EXPECT_FALSE(sut.contains(std::array<std::uint8_t, 2>{2, 3}));
}

}  // namespace
}  // namespace swarmtalk::kilobot_bridge
