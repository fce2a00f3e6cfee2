// facts.hpp held against images in the emulator: our own in every run, kilolib's where there is
// one; and against the emulator's model of a body.
#include "tests/kilobot/judge/facts.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/kilobot/judge/images.hpp"

namespace swarmtalk::judge {
namespace {

class Facts : public testing::TestWithParam<Maker> {
 protected:
  void SetUp() override {
    if (const std::string reason = missing(GetParam()); !reason.empty()) GTEST_SKIP() << reason;
  }
  Bench bench(const emulator::Eeprom& eeprom = calibrated(), std::uint16_t battery_counts = 700) {
    return Bench(probe_of(GetParam()), eeprom, battery_counts);
  }
  Bench running() {
    Bench robot = bench();
    robot.send(kRun, {});
    return robot;
  }
};

INSTANTIATE_TEST_SUITE_P(Images, Facts, testing::ValuesIn(makers()),
                         [](const auto& maker) { return to_text(maker.param); });

/// Behind whatever was before: one push, then the duties, to the end.
void expect_push_and_then(const Seen& seen, MotorPins push, MotorPins then) {
  std::vector<Stretch<MotorPins>> moves = seen.motors;
  if (!moves.empty() && moves.front().value == MotorPins{}) moves.erase(moves.begin());
  ASSERT_EQ(moves.size(), 2u);
  EXPECT_EQ(moves[0].value, push);
  EXPECT_NEAR(moves[0].ms, kPushMs, kPushErrorMs);
  EXPECT_EQ(moves[1].value, then);
}

TEST_P(Facts, TheFirstMotorIsPb3AndTheSecondPd3) {
  Bench robot = running();
  robot.call(Call::kSetMotors, {70, 0});
  EXPECT_EQ(robot.motors(), (MotorPins{70, 0}));
  robot.call(Call::kSetMotors, {0, 66});
  EXPECT_EQ(robot.motors(), (MotorPins{0, 66}));
  robot.call(Call::kSetMotors, {60, 66});
  EXPECT_EQ(robot.motors(), (MotorPins{60, 66}));
  robot.call(Call::kSetMotors, {0, 0});
  EXPECT_EQ(robot.motors(), MotorPins{});
}

TEST_P(Facts, MotorsRunOnPhaseCorrectPwmOfTwoKilohertz) {
  Bench robot = running();
  robot.call(Call::kSetMotors, {70, 66});
  EXPECT_EQ(robot.mcu().data(0xB0), 0xA1);  // both outputs clear on the way up; mode 1
  EXPECT_EQ(robot.mcu().data(0xB1), 2);     // clock / 8
}

TEST_P(Facts, MovesBeginWithAPushAndEndAtTheirDuties) {
  for (const MotorFact& fact : motor_facts()) {
    SCOPED_TRACE(fact.what);
    Bench robot = bench();
    expect_push_and_then(robot.send(fact.type, fact.data), fact.push, fact.then);
  }
}

TEST_P(Facts, ProgramsTurnLeftWithPb3AndRightWithPd3) {
  Bench robot = running();
  robot.call(Call::kTurnLeft);
  expect_push_and_then(robot.seen(), {255, 0}, {71, 0});
  robot.call(Call::kStop);
  robot.call(Call::kTurnRight);
  expect_push_and_then(robot.seen(), {0, 255}, {0, 62});
  robot.call(Call::kStop);
  robot.call(Call::kStraight);
  expect_push_and_then(robot.seen(), {255, 255}, {60, 66});
}

/// The body turns as the names of the calls say, whoever makes them.
TEST_P(Facts, TheEmulatorsBodyTurnsAsTheCallsAreNamed) {
  for (const MotorFact& fact : motor_facts()) {
    SCOPED_TRACE(fact.what);
    Bench robot = bench();
    robot.send(fact.type, fact.data);
    const emulator::MotorDuty duty = emulator::read_motors(robot.mcu());
    EXPECT_EQ((MotorPins{duty.left, duty.right}), fact.then);
    const double theta_rad = emulator::move({}, duty, 1).theta_rad;
    if (fact.turns != 0) {
      EXPECT_GT(theta_rad * fact.turns, 0.5);
    } else {
      EXPECT_LT(std::abs(theta_rad), 0.1);
    }
  }
}

TEST_P(Facts, TheLedHasThreeLevelsOfEachColour) {
  Bench robot = running();
  for (std::uint8_t colour = 0; colour < 64; ++colour) {
    const std::array<std::uint8_t, 3> levels{static_cast<std::uint8_t>(colour & 3),
                                             static_cast<std::uint8_t>(colour >> 2 & 3),
                                             static_cast<std::uint8_t>(colour >> 4)};
    SCOPED_TRACE(int{colour});
    robot.call(Call::kSetColour, {levels[0], levels[1], levels[2]}, 15);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const LedFact& fact = kLedFacts[i];
      const std::uint8_t outputs = robot.mcu().data(fact.direction);
      EXPECT_EQ((outputs >> fact.weak & 1) + 2 * (outputs >> fact.strong & 1), levels[i])
          << fact.colour << " of colour " << int{colour};
    }
    const emulator::LedColour shown = emulator::read_led(robot.mcu());
    EXPECT_EQ((std::array{shown.red, shown.green, shown.blue}), levels);
  }
}

TEST_P(Facts, EachStateShowsItsColour) {
  for (const StateFact& fact : state_facts()) {
    SCOPED_TRACE(fact.what);
    Bench robot = bench(calibrated(), fact.battery_counts);
    robot.mcu().set_charging(fact.is_charging);
    robot.send(fact.type, {});
    const Seen seen = robot.watch(450);
    unsigned flashes = 0;
    for (const Stretch<Led>& stretch : seen.led) {
      if (stretch.value == Led{} && fact.lit_ms > 0) continue;
      EXPECT_EQ(stretch.value, fact.shows);
      if (fact.lit_ms > 0) {
        EXPECT_NEAR(stretch.ms, fact.lit_ms, 0.3);
      }
      ++flashes;
    }
    EXPECT_GE(flashes, fact.lit_ms > 0 ? 2u : 1u);
    EXPECT_LE(flashes, 3u);
  }
}

TEST_P(Facts, CalibrationIsSavedInItsCells) {
  Bench robot = bench();
  const emulator::Eeprom before = robot.eeprom();
  robot.send(kCalibrate, {kModeUid, 0x34, 0x12});
  robot.send(kCalibrate, {kModeLeft, 0, 0, 81});
  robot.send(kCalibrate, {kModeRight, 0, 0, 0, 82});
  robot.send(kCalibrate, {kModeStraight, 0, 0, 0, 0, 83, 84});
  EXPECT_EQ(robot.eeprom(), before) << "not yet";
  robot.send(kCalibrate, {kModeSave});
  EXPECT_EQ(robot.motors(), MotorPins{});
  emulator::Eeprom expected = before;
  expected[kCellUid] = 0x34;
  expected[kCellUid + 1] = 0x12;
  expected[kCellTurnLeft] = 81;
  expected[kCellTurnRight] = 82;
  expected[kCellStraightLeft] = 83;
  expected[kCellStraightRight] = 84;
  EXPECT_EQ(robot.eeprom(), expected);
  robot.send(kReset, {});
  robot.send(kRun, {});
  EXPECT_EQ(robot.call(Call::kUid), 0x1234);
  EXPECT_EQ(robot.call(Call::kTurnLeftDuty), 81);
  EXPECT_EQ(robot.call(Call::kTurnRightDuty), 82);
  EXPECT_EQ(robot.call(Call::kStraightLeft), 83);
  EXPECT_EQ(robot.call(Call::kStraightRight), 84);
}

/// A uid given to a robot that has no duties leaves it without: others may want to know.
TEST_P(Facts, SavingAUidLeavesErasedCellsErased) {
  emulator::Eeprom blank(emulator::kEepromBytes, 0xFF);
  Bench robot = bench(blank);
  robot.send(kCalibrate, {kModeUid, 7, 0});
  robot.send(kCalibrate, {kModeSave});
  blank[kCellUid] = 7;
  blank[kCellUid + 1] = 0;
  EXPECT_EQ(robot.eeprom(), blank);
}

TEST_P(Facts, DistancesFollowTheTables) {
  Bench robot = running();
  for (const DistanceFact& fact : kDistanceFacts) {
    const auto low_byte = [](std::uint16_t word) { return static_cast<std::uint8_t>(word); };
    const auto high_byte = [](std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8); };
    EXPECT_EQ(robot.call(Call::kDistance, {low_byte(fact.high), high_byte(fact.high),
                                           low_byte(fact.low), high_byte(fact.low)}),
              fact.mm)
        << fact.high << ", " << fact.low;
  }
}

TEST_P(Facts, AMessagesStrengthIsMeasuredAtHighGainAndThenAtLow) {
  Bench robot = running();
  robot.call(Call::kNothing);
  const emulator::SignalStrength strength = emulator::signal_at(50);
  EXPECT_EQ(robot.variable("probe_high"), strength.high_gain);
  EXPECT_EQ(robot.variable("probe_low"), strength.low_gain);
}

TEST_P(Facts, SingleReadingsUseTheirChannelReferenceAndClock) {
  for (const ReadingFact& fact : kReadingFacts) {
    Bench robot = running();
    EXPECT_THAT(robot.readings_of(fact.call), testing::ElementsAre(fact.reading))
        << static_cast<int>(fact.call);
  }
}

TEST_P(Facts, InfraredLightComesFromThePinsOfTheCell) {
  for (const TransmitFact& fact : kTransmitFacts) {
    emulator::Eeprom eeprom = calibrated();
    eeprom[kCellTransmitPins] = fact.cell;
    Bench robot = bench(eeprom);
    robot.send(kRun, {});
    EXPECT_EQ(robot.transmitting_pins(), fact.pins) << "cell " << int{fact.cell};
  }
}

TEST_P(Facts, AClockTickIs32768Microseconds) {
  Bench robot = running();
  const std::uint16_t before = robot.call(Call::kTicks, {}, 40);
  robot.watch(1000 - 40);
  EXPECT_NEAR(robot.call(Call::kTicks, {}, 40) - before, 1000 / 32.768, 1);
}

TEST_P(Facts, AnErasedDutyNeverKeepsAMotorAtFullPower) {
  if (GetParam() == Maker::kKilolib) GTEST_SKIP() << "kilolib drives erased duties as 255";
  Bench robot = bench(emulator::Eeprom(emulator::kEepromBytes, 0xFF));
  expect_push_and_then(robot.send(kReadUid, {0}), {255, 0}, {65, 0});
  robot.send(kRun, {});
  robot.call(Call::kStraight);
  expect_push_and_then(robot.seen(), {255, 255}, {65, 65});
}

}  // namespace
}  // namespace swarmtalk::judge
