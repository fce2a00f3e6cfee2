#include "drivers/beacon.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

constexpr Beacon::Time kStart(1000s);

TEST(Beacon, IsOffAtZero) {
  EXPECT_FALSE(Beacon(0ms, 1).is_on());
  EXPECT_TRUE(Beacon(1ms, 1).is_on());
}

TEST(Beacon, SilenceLastsTheIntervalLessAtMostAQuarter) {
  Beacon beacon(1000ms, 1);
  auto shortest = Beacon::Duration::max();
  auto longest = Beacon::Duration::min();
  for (int i = 0; i < 1000; ++i) {
    beacon.silence_begins(kStart);
    shortest = std::min(shortest, beacon.wait(kStart));
    longest = std::max(longest, beacon.wait(kStart));
  }
  EXPECT_GE(shortest, 750ms);
  EXPECT_LE(longest, 1000ms);
  EXPECT_GT(longest - shortest, 200ms) << "robots that start together must not speak together";
}

TEST(Beacon, EachFrameBeginsTheSilenceAnew) {
  Beacon beacon(1000ms, 1);
  beacon.silence_begins(kStart);
  EXPECT_EQ(beacon.wait(kStart + 1000ms), 0ms);
  beacon.silence_begins(kStart + 700ms);
  EXPECT_GE(beacon.wait(kStart + 1000ms), 450ms);
  EXPECT_EQ(beacon.wait(kStart + 1700ms), 0ms);
}

}  // namespace
}  // namespace swarmtalk::drivers
