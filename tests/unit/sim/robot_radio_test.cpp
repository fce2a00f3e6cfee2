#include "sim/robot_radio.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::sim {
namespace {

using Damage = RobotRadio::Damage;

constexpr uint32_t kAirUs = 100;
constexpr uint32_t kTurnaroundUs = 10;

TEST(RobotRadio, ReceivesAPacketOnFreeAir) {
  RobotRadio sut;
  EXPECT_FALSE(sut.is_receiving());
  EXPECT_EQ(sut.begin(3, 1000, kAirUs), Damage::kNone);
  EXPECT_TRUE(sut.is_receiving(3));
  EXPECT_FALSE(sut.is_receiving(4));
  EXPECT_EQ(sut.end(), Damage::kNone);
  EXPECT_FALSE(sut.is_receiving());
}

TEST(RobotRadio, ASecondPacketDamagesBoth) {
  RobotRadio sut;
  sut.begin(3, 1000, kAirUs);
  EXPECT_EQ(sut.begin(4, 1000, kAirUs), Damage::kCollision);
  EXPECT_TRUE(sut.is_receiving(3));
  EXPECT_EQ(sut.end(), Damage::kCollision);
  EXPECT_EQ(sut.begin(5, 1050, kAirUs), Damage::kCollision) << "their carriers are still there";
  EXPECT_EQ(sut.begin(5, 1150, kAirUs), Damage::kNone);
}

TEST(RobotRadio, HearsNothingWhileItSends) {
  RobotRadio sut;
  sut.begin(3, 1000, kAirUs);
  EXPECT_EQ(sut.send(1050, kAirUs), 1150u);
  EXPECT_EQ(sut.end(), Damage::kSending);
  EXPECT_EQ(sut.begin(4, 1149, kAirUs), Damage::kSending);
  EXPECT_FALSE(sut.is_receiving());
}

TEST(RobotRadio, KeepsTheFirstDamage) {
  RobotRadio sut;
  sut.begin(3, 1000, kAirUs);
  sut.begin(4, 1010, kAirUs);
  sut.send(1020, kAirUs);
  EXPECT_EQ(sut.end(), Damage::kCollision);
}

TEST(RobotRadio, NoticesACarrierAfterAWhile) {
  RobotRadio sut;
  EXPECT_FALSE(sut.is_taken(1000, kTurnaroundUs));
  sut.begin(3, 1000, kAirUs);
  EXPECT_FALSE(sut.is_taken(1009, kTurnaroundUs));
  EXPECT_TRUE(sut.is_taken(1010, kTurnaroundUs));
  EXPECT_FALSE(sut.is_taken(1100, kTurnaroundUs));
  sut.send(2000, kAirUs);
  EXPECT_TRUE(sut.is_taken(2000, kTurnaroundUs)) << "its own packet at once";
  EXPECT_FALSE(sut.is_taken(2100, kTurnaroundUs));
}

}  // namespace
}  // namespace swarmtalk::sim
