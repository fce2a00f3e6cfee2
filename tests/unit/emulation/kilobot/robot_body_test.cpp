#include "emulation/kilobot/robot_body.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

namespace swarmtalk::emulator {
namespace {

/// An image of hand-made instructions, run for a moment.
std::unique_ptr<Mcu> run(const std::vector<std::uint16_t>& words) {
  Image image;
  for (std::size_t i = 0; i < words.size(); ++i) {
    image.flash[2 * i] = static_cast<std::uint8_t>(words[i]);
    image.flash[2 * i + 1] = static_cast<std::uint8_t>(words[i] >> 8);
  }
  static Image kept;  // the processor refers to it
  kept = image;
  auto mcu = std::make_unique<Mcu>(kept, make_eeprom({}), McuSettings{});
  mcu->run_until(100);
  return mcu;
}

TEST(RobotBody, ReadsTheMotorsFromTheirTimer) {
  // sbi DDRB, 3; TCCR2A = COM2A1 | COM2B1 | WGM20; TCCR2B = 2; OCR2A = 70; rjmp .
  const auto mcu =
      run({0x9A23, 0xEA01, 0x9300, 0x00B0, 0xE002, 0x9300, 0x00B1, 0xE406, 0x9300, 0x00B3, 0xCFFF});
  EXPECT_EQ(read_motors(*mcu), (MotorDuty{70, 0}));
}

TEST(RobotBody, ReadsTheMotorsFromTheirPinsWithoutTimer) {
  // sbi DDRD, 3; sbi PORTD, 3; rjmp .: a push at full power
  EXPECT_EQ(read_motors(*run({0x9A53, 0x9A5B, 0xCFFF})), (MotorDuty{0, 255}));
}

TEST(RobotBody, ReadsTheLedFromTheDirections) {
  // sbi DDRD, 5; sbi DDRC, 2; sbi DDRC, 4; sbi DDRC, 5; rjmp .
  EXPECT_EQ(read_led(*run({0x9A55, 0x9A3A, 0x9A3C, 0x9A3D, 0xCFFF})), (LedColour{1, 2, 3}));
}

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

TEST(RobotBody, AWeakMotorBendsTheWayToItsSide) {
  EXPECT_LT(move({}, {65, 65}, 1, {0.9, 1}).theta_rad, 0) << "left is weak: to the right";
  EXPECT_GT(move({}, {65, 65}, 1, {1, 0.9}).theta_rad, 0);
}

TEST(RobotBody, StaysBelowTheThreshold) {
  const BodyPose pose = move({1, 2, 3}, {20, 20}, 10);
  EXPECT_EQ(pose.x_mm, 1);
  EXPECT_EQ(pose.theta_rad, 3);
}

}  // namespace
}  // namespace swarmtalk::emulator
