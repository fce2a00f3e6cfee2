#include "emulation/kilobot/ir_front_end.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::emulator {
namespace {

const SignalStrength kNear{900, 700}, kFar{300, 100};

TEST(IrFrontEnd, IsLitFromTheFirstRisingToTheLastFallingEdge) {
  IrFrontEnd front_end;
  front_end.push({10, kNear, true});
  front_end.push({30, kNear, false});
  front_end.push({20, kFar, true});
  front_end.push({40, kFar, false});
  EXPECT_TRUE(front_end.apply_until(10));
  EXPECT_FALSE(front_end.apply_until(30));
  EXPECT_TRUE(front_end.is_lit());
  EXPECT_TRUE(front_end.apply_until(40));
  EXPECT_FALSE(front_end.is_lit());
}

TEST(IrFrontEnd, ShowsEachChangeOfTheComparatorOnItsOwn) {
  IrFrontEnd front_end;
  front_end.push({10, kNear, true});
  front_end.push({11, kNear, false});
  EXPECT_TRUE(front_end.apply_until(100));
  EXPECT_TRUE(front_end.is_lit());
  EXPECT_EQ(front_end.next_cycle(), 11u);
  EXPECT_TRUE(front_end.apply_until(100));
  EXPECT_FALSE(front_end.is_lit());
  EXPECT_EQ(front_end.next_cycle(), IrFrontEnd::kNever);
}

TEST(IrFrontEnd, AddsUpTheLightOfSendersAndHoldsThePeak) {
  IrFrontEnd front_end;
  front_end.push({10, kFar, true});
  front_end.apply_until(10);
  EXPECT_EQ(front_end.peak().high_gain, 300);
  front_end.push({20, {400, 200}, true});
  front_end.apply_until(20);
  EXPECT_EQ(front_end.peak().high_gain, 700);
  EXPECT_EQ(front_end.peak().low_gain, 300);
  front_end.push({30, kFar, false});
  front_end.apply_until(30);
  EXPECT_EQ(front_end.peak().high_gain, 700);
}

TEST(IrFrontEnd, ShowsNoMoreThanTheConverterCan) {
  IrFrontEnd front_end;
  front_end.push({10, kNear, true});
  front_end.push({11, kNear, true});
  front_end.apply_until(10);
  front_end.apply_until(11);
  EXPECT_EQ(front_end.peak().high_gain, 1023);
}

TEST(SignalModel, FallsWithDistance) {
  EXPECT_GT(signal_at(33).high_gain, signal_at(60).high_gain);
  EXPECT_GT(signal_at(60).low_gain, signal_at(90).low_gain);
  EXPECT_GE(signal_at(1000).high_gain, 1);
}

TEST(SignalModel, AgreesWithTheCalibrationTables) {
  for (int i = 1; i < kCalibrationEntries; ++i) {
    const SignalStrength there = signal_at(kRobotDiameterMm + i * kCalibrationStepMm);
    EXPECT_NEAR(there.high_gain, calibration_entry(i).high_gain, 1);
    EXPECT_NEAR(there.low_gain, calibration_entry(i).low_gain, 1);
  }
}

}  // namespace
}  // namespace swarmtalk::emulator
