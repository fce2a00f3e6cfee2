#include "swarmtalk/checksum.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::core {
namespace {

const uint8_t kDigits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};

TEST(Checksum, MatchesKnownValues) {
  EXPECT_EQ(crc8(kDigits, 9), 0xFB);  // CRC-8 with start 0xFF ("CRC-8/ROHC" is its reflection)
  EXPECT_EQ(sum8(kDigits, 9), 0xDD);
}

TEST(Checksum, OfNothingIsTheStartValue) {
  EXPECT_EQ(sum8(kDigits, 0), 0);
  EXPECT_EQ(crc8(kDigits, 0), 0xFF);
}

TEST(Checksum, IsChosenByKind) {
  EXPECT_EQ(checksum<Checksum::kNone>(kDigits, 9), 0);
  EXPECT_EQ(checksum<Checksum::kSum8>(kDigits, 9), 0xDD);
  EXPECT_EQ(checksum<Checksum::kCrc8>(kDigits, 9), 0xFB);
}

TEST(Checksum, Sum8WrapsAt256AndMissesSwappedBytes) {
  const uint8_t bytes[] = {255, 2, 1};
  const uint8_t swapped[] = {2, 255, 1};
  EXPECT_EQ(sum8(bytes, 3), 2);
  EXPECT_EQ(sum8(swapped, 3), sum8(bytes, 3));
}

TEST(Checksum, Crc8FindsSwappedBytesAndTheAllZeroPacket) {
  const uint8_t ab[] = {1, 2};
  const uint8_t ba[] = {2, 1};
  const uint8_t zeros[9] = {};
  EXPECT_NE(crc8(ab, 2), crc8(ba, 2));
  EXPECT_NE(crc8(zeros, 8), 0);
}

/// The last of 9 bytes is the checksum of the others, as in a packet.
TEST(Checksum, Crc8FindsEveryErrorOfUpToThreeBitsInAPacket) {
  uint8_t packet[9];
  for (uint8_t i = 0; i < 8; ++i) packet[i] = static_cast<uint8_t>(37 * i + 11);
  packet[8] = crc8(packet, 8);
  const auto flip = [&packet](int bit) {
    packet[bit / 8] = static_cast<uint8_t>(packet[bit / 8] ^ 1 << bit % 8);
  };
  int missed = 0;
  for (int a = 0; a < 72; ++a) {
    flip(a);
    missed += crc8(packet, 8) == packet[8];
    for (int b = a + 1; b < 72; ++b) {
      flip(b);
      missed += crc8(packet, 8) == packet[8];
      for (int c = b + 1; c < 72; ++c) {
        flip(c);
        missed += crc8(packet, 8) == packet[8];
        flip(c);
      }
      flip(b);
    }
    flip(a);
  }
  EXPECT_EQ(missed, 0);
}

}  // namespace
}  // namespace swarmtalk::core
