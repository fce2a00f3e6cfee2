#include "sim/robot_clock.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::sim {
namespace {

TEST(RobotClock, BeginsWhenTheRobotIsSwitchedOn) {
  const RobotClock sut(0, 1000);
  EXPECT_EQ(sut.power_on_us(), 1000u);
  EXPECT_EQ(sut.ticks(1000), 0u);
  EXPECT_EQ(sut.ticks(1000 + 3 * kTickUs - 1), 2u);
  EXPECT_EQ(sut.ticks(1000 + 3 * kTickUs), 3u);
}

TEST(RobotClock, DriftsBothWays) {
  const RobotClock fast(10000, 0);
  const RobotClock slow(-10000, 0);
  EXPECT_EQ(fast.ticks(100 * kTickUs), 101u);
  EXPECT_EQ(slow.ticks(100 * kTickUs), 99u);
  EXPECT_EQ(fast.true_us(1000000), 990000u);
  EXPECT_EQ(slow.true_us(1000000), 1010000u);
}

TEST(RobotClock, JumpsUntilItsRobotStartsAgain) {
  RobotClock sut(0, 0);
  sut.jump(7);
  sut.jump(-2);
  EXPECT_EQ(sut.ticks(10 * kTickUs), 15u);
  sut.restart(10 * kTickUs);
  EXPECT_EQ(sut.ticks(11 * kTickUs), 1u);
}

}  // namespace
}  // namespace swarmtalk::sim
