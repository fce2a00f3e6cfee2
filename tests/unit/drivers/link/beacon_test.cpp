#include "drivers/link/beacon.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

constexpr Beacon::Time kBeaconStart(1000s);

TEST(Beacon, IsOffAtZero) {
  EXPECT_FALSE(Beacon(0ms, 1).is_on());
  EXPECT_TRUE(Beacon(1ms, 1).is_on());
}

TEST(Beacon, SilenceLastsTheIntervalLessAtMostAQuarter) {
  Beacon beacon(1000ms, 1);
  auto shortest = Beacon::Duration::max();
  auto longest = Beacon::Duration::min();
  for (int i = 0; i < 1000; ++i) {
    beacon.silence_begins(kBeaconStart);
    shortest = std::min(shortest, beacon.wait(kBeaconStart));
    longest = std::max(longest, beacon.wait(kBeaconStart));
  }
  EXPECT_GE(shortest, 750ms);
  EXPECT_LE(longest, 1000ms);
  EXPECT_GT(longest - shortest, 200ms) << "robots that start together must not speak together";
}

TEST(Beacon, EachFrameBeginsTheSilenceAnew) {
  Beacon beacon(1000ms, 1);
  beacon.silence_begins(kBeaconStart);
  EXPECT_EQ(beacon.wait(kBeaconStart + 1000ms), 0ms);
  beacon.silence_begins(kBeaconStart + 700ms);
  EXPECT_GE(beacon.wait(kBeaconStart + 1000ms), 450ms);
  EXPECT_EQ(beacon.wait(kBeaconStart + 1700ms), 0ms);
}

}  // namespace
}  // namespace swarmtalk::drivers
