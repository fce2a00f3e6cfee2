#include "tools/kilobot_emulator/robot_body.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace swarmtalk::emulator {
namespace {

TEST(RobotBody, DrivesStraightWithBothMotors) {
  const BodyPose pose = move({0, 0, M_PI / 2}, {65, 65}, 2);
  EXPECT_NEAR(pose.x_mm, 0, 1e-9);
  EXPECT_NEAR(pose.y_mm, 20, 1e-9);
  EXPECT_NEAR(pose.theta_rad, M_PI / 2, 1e-9);
}

TEST(RobotBody, TurnsLeftWithTheLeftMotorAndRightWithTheRight) {
  EXPECT_NEAR(move({}, {65, 0}, 1).theta_rad, M_PI / 4, 1e-9);
  EXPECT_NEAR(move({}, {0, 65}, 1).theta_rad, -M_PI / 4, 1e-9);
}

TEST(RobotBody, StaysBelowTheThreshold) {
  const BodyPose pose = move({1, 2, 3}, {20, 20}, 10);
  EXPECT_EQ(pose.x_mm, 1);
  EXPECT_EQ(pose.theta_rad, 3);
}

}  // namespace
}  // namespace swarmtalk::emulator
