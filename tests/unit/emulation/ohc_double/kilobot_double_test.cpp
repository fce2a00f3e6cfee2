#include "emulation/ohc_double/kilobot_double.hpp"

#include <gtest/gtest.h>

#include "kilobot_wire/ohc_frame.hpp"

namespace swarmtalk::ohc_double {
namespace {

using State = KilobotDouble::State;
using Data = std::array<std::uint8_t, 9>;

class KilobotDoubleTest : public testing::Test {
 protected:
  void hear(std::uint8_t type, const Data& data = {}) {
    robot_.hear(emulator::make_ir_message(data, type), now_ns_ += 10'400'000);
  }
  void hear_page(std::uint8_t page, std::uint8_t fill, int skip = -1) {
    for (int i = 0; i < 22; ++i) {
      if (i == skip) continue;
      hear(kIrBootPage,
           {page, static_cast<std::uint8_t>(i * 3), fill, fill, fill, fill, fill, fill});
    }
  }

  KilobotDouble robot_{5, 0, 1};
  std::uint64_t now_ns_ = 0;
};

TEST_F(KilobotDoubleTest, RunsOnceUntilReset) {
  hear(kIrRun);
  hear(kIrRun);
  EXPECT_EQ(robot_.state(), State::kRunning);
  EXPECT_EQ(robot_.setups(), 1u);
  EXPECT_TRUE(robot_.has_motors_enabled());
  hear(kIrReset);
  EXPECT_EQ(robot_.state(), State::kIdle);
  EXPECT_EQ(robot_.setups(), 0u);
}

TEST_F(KilobotDoubleTest, LosesItsMotorsToAStrayTypeUntilWakeUpAndRun) {
  hear(kIrRun);
  hear(0x90);
  EXPECT_EQ(robot_.state(), State::kRunning);
  EXPECT_FALSE(robot_.has_motors_enabled());
  hear(kIrRun);
  EXPECT_FALSE(robot_.has_motors_enabled());
  hear(kIrWakeUp);
  hear(kIrRun);
  EXPECT_TRUE(robot_.has_motors_enabled());
}

TEST_F(KilobotDoubleTest, GivesUserMessagesToThePausedProgram) {
  int count = 0;
  robot_.on_user_message = [&](const emulator::IrMessage&) { ++count; };
  hear(0x00);
  hear(0x7F);
  EXPECT_EQ(count, 2);
}

TEST_F(KilobotDoubleTest, WakesOnlyAfterItsSleepPeriod) {
  hear(kIrSleep);
  for (int i = 0; i < 500; ++i) hear(kIrWakeUp);  // 5.2 s
  EXPECT_EQ(robot_.state(), State::kSleeping);
  for (int i = 0; i < 700; ++i) hear(kIrWakeUp);
  EXPECT_EQ(robot_.state(), State::kIdle);
}

TEST_F(KilobotDoubleTest, ShowsItsUidBitByBit) {
  hear(kIrReadUid, {0});
  EXPECT_EQ(robot_.state(), State::kMoving);
  EXPECT_EQ(robot_.motors(), (KilobotDouble::Motors{70, 0}));
  hear(kIrReadUid, {1});
  EXPECT_EQ(robot_.motors(), (KilobotDouble::Motors{0, 0}));
}

TEST_F(KilobotDoubleTest, KeepsCalibrationOnlyWhenSaved) {
  hear(kIrCalibrate, {1, 0xD2, 0x04});
  EXPECT_EQ(robot_.values().uid, 1234);
  hear(kIrReset);
  EXPECT_EQ(robot_.values().uid, 5);
  hear(kIrCalibrate, {1, 0xD2, 0x04});
  hear(kIrCalibrate, {0});
  EXPECT_EQ(robot_.state(), State::kIdle);
  EXPECT_EQ(robot_.eeprom().uid, 1234);
}

TEST_F(KilobotDoubleTest, IgnoresSaveUnlessMoving) {
  hear(kIrCalibrate, {0});
  EXPECT_EQ(robot_.state(), State::kIdle);
  EXPECT_EQ(robot_.eeprom().uid, 5);
}

TEST_F(KilobotDoubleTest, NeedsEveryMessageOfAPage) {
  hear(kIrBoot);
  hear(kIrBootSize, {2});
  hear_page(0, 0xAA, 7);
  hear_page(1, 0xBB);
  EXPECT_EQ(robot_.pages_done(), 1u);
  hear_page(0, 0xAA);
  EXPECT_EQ(robot_.state(), State::kIdle);
  EXPECT_EQ(robot_.flash()[127], 0xAA);
  EXPECT_EQ(robot_.flash()[128], 0xBB);
}

TEST_F(KilobotDoubleTest, WritesAHoleIntoAOnePageProgram) {
  hear(kIrBoot);
  hear(kIrBootSize, {1});
  hear_page(0, 0xAA, 7);
  hear(kIrBootPage, {0, 0, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA, 0xAA});
  EXPECT_EQ(robot_.state(), State::kIdle);
  EXPECT_EQ(robot_.flash()[7 * 6], 0xFF);
}

TEST_F(KilobotDoubleTest, LeavesTheBootloaderForANeighboursMessage) {
  hear(kIrBoot);
  EXPECT_EQ(robot_.state(), State::kBootloader);
  hear(0x00);
  EXPECT_EQ(robot_.state(), State::kIdle);
}

TEST_F(KilobotDoubleTest, StaysInTheBootloaderOnceAPageIsThere) {
  hear(kIrBoot);
  hear_page(0, 0xAA);
  hear(0x00);
  EXPECT_EQ(robot_.state(), State::kBootloader);
}

TEST_F(KilobotDoubleTest, IsRuinedByAPageOverItsBootloader) {
  hear(kIrBoot);
  hear_page(KilobotDouble::kBootloaderPage, 0xAA);
  EXPECT_TRUE(robot_.has_damaged_bootloader());
}

TEST(KilobotDouble, MissesMessagesWithTheGivenProbability) {
  KilobotDouble robot(1, 0.25, 7);
  int count = 0;
  robot.on_user_message = [&](const emulator::IrMessage&) { ++count; };
  for (unsigned i = 0; i < 4000; ++i)
    robot.hear(emulator::make_ir_message({}, 0), i * std::uint64_t{10'400'000});
  EXPECT_NEAR(count, 3000, 100);
}

}  // namespace
}  // namespace swarmtalk::ohc_double
