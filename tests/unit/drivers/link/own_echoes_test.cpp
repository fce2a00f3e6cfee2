// Which frames from our own hardware address are ours.
#include "drivers/link/own_echoes.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

constexpr MonotonicTime kBegin{1000s};

std::vector<std::uint8_t> frame_of(std::uint32_t epoch) {
  std::vector<std::uint8_t> bytes(100);
  frame::FrameHeader header;
  header.epoch = epoch;
  frame::FrameWriter writer(bytes, header, bytes.size());
  bytes.resize(writer.finish().size());
  return bytes;
}

TEST(OwnEchoes, AreToldByTheirEpoch) {
  OwnEchoes echoes;
  echoes.begin(0x12345678, kBegin);
  const MonotonicTime later = kBegin + OwnEchoes::kLongestHeld;
  EXPECT_TRUE(echoes.is_ours(frame_of(0x12345678), later));
  for (const std::uint32_t other : {0x12345679u, 0x02345678u, 0u}) {
    EXPECT_FALSE(echoes.is_ours(frame_of(other), later)) << other;
  }
}

TEST(OwnEchoes, AreAllForAWhileAfterTheStart) {
  OwnEchoes echoes;
  echoes.begin(1, kBegin);
  EXPECT_TRUE(echoes.is_ours(frame_of(2), kBegin)) << "of the daemon that was here before";
  EXPECT_TRUE(echoes.is_ours(frame_of(2), kBegin + OwnEchoes::kLongestHeld - 1ms));
}

TEST(OwnEchoes, AreFramesThatAreTooShortToTell) {
  OwnEchoes echoes;
  echoes.begin(1, kBegin);
  const std::vector<std::uint8_t> bytes(frame::kHeaderBytes - 1, 0xA5);
  EXPECT_TRUE(echoes.is_ours(bytes, kBegin + 1h));
  EXPECT_TRUE(echoes.is_ours({}, kBegin + 1h));
}

}  // namespace
}  // namespace swarmtalk::drivers
