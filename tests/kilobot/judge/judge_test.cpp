// The same messages and calls to an image on kilolib and to ours: whatever a motor, a LED, a cell
// of EEPROM or a register makes of them is compared. Needs a kilolib (-DKILOLIB=); nothing of it is
// here.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "emulation/kilobot/random.hpp"
#include "tests/kilobot/judge/differences.hpp"
#include "tests/kilobot/judge/facts.hpp"
#include "tests/kilobot/judge/images.hpp"

namespace swarmtalk::judge {
namespace {

constexpr std::uint16_t kTimer2[] = {0xB0, 0xB1, 0xB3, 0xB4};
constexpr std::uint16_t kBatteries[] = {700, 660, 630, 600};
constexpr std::uint8_t kDuties[] = {0, 1, 60, 66, 254, 255};
/// Stretches this close are equal: kilolib's are longer by the interrupts that fall into them.
constexpr double kSameMs = 1.1;

std::string text_of(const MotorPins& pins) {
  return "(" + std::to_string(pins.pb3) + ", " + std::to_string(pins.pd3) + ")";
}

/// Motors from a message on: values in their order; the pushes between first and last with times.
std::string text_of(const std::vector<Stretch<MotorPins>>& stretches) {
  std::string text;
  for (const Stretch<MotorPins>& stretch : stretches) text += text_of(stretch.value) + " ";
  return text;
}

/// Colours that the LED shows in a state, however its flashes fall, and the longest of each.
std::map<Led, double> colours_of(const std::vector<Stretch<Led>>& stretches) {
  std::map<Led, double> longest;
  for (const Stretch<Led>& stretch : stretches)
    if (stretch.value != Led{})
      longest[stretch.value] = std::max(longest[stretch.value], stretch.ms);
  return longest;
}

std::string text_of(const std::map<Led, double>& colours) {
  std::string text;
  for (const auto& [led, ms] : colours)
    text += std::to_string(100 * led.red + 10 * led.green + led.blue) + " for " +
            std::to_string(ms) + " ms; ";
  return text.empty() ? "dark" : text;
}

class Judge : public testing::Test {
 protected:
  void SetUp() override {
    for (const Maker maker : {Maker::kOurs, Maker::kKilolib})
      if (const std::string reason = missing(maker); !reason.empty()) GTEST_SKIP() << reason;
  }

  /// Two robots that are alike but for who made their firmware.
  void power_on(const emulator::Eeprom& eeprom = calibrated(), std::uint16_t battery = 700) {
    has_voltage_shown_ = false;
    ours_ = std::make_unique<Bench>(probe_of(Maker::kOurs), eeprom, battery);
    theirs_ = std::make_unique<Bench>(probe_of(Maker::kKilolib), eeprom, battery);
  }

  void send(std::uint8_t type, const std::vector<std::uint8_t>& data = {}) {
    // kilolib shows red while a message arrives instead of the voltage, and a program or a move
    // begins with whatever is shown (defects_not_repeated()).
    const bool keeps_led = type == kRun || type == kCalibrate || type == kReadUid;
    has_voltage_shown_ = type == kVoltage || (keeps_led && has_voltage_shown_);
    expect_same_motion(ours_->send(type, data).motors, theirs_->send(type, data).motors);
    expect_same_state(!(keeps_led && has_voltage_shown_));
  }

  void call(Call call, const std::vector<std::uint8_t>& arguments = {}) {
    EXPECT_EQ(ours_->call(call, arguments), theirs_->call(call, arguments));
    expect_same_motion(ours_->seen().motors, theirs_->seen().motors);
    EXPECT_EQ(ours_->led(), theirs_->led());
    expect_same_registers();
  }

  void expect_same_motion(const std::vector<Stretch<MotorPins>>& ours,
                          std::vector<Stretch<MotorPins>> theirs) {
    // A stop that comes between two looks of kilolib's loop pushes both motors once more
    // (defects_not_repeated()).
    if (theirs.size() == ours.size() + 1 && theirs.back().value == MotorPins{} &&
        theirs[theirs.size() - 2].value == MotorPins{255, 255})
      theirs.erase(theirs.end() - 2);
    ASSERT_EQ(text_of(ours), text_of(theirs));
    for (std::size_t i = 1; i + 1 < ours.size(); ++i)
      EXPECT_NEAR(ours[i].ms, theirs[i].ms, kSameMs) << text_of(ours[i].value);
  }

  void expect_same_state(bool compares_led = true) {
    const std::map<Led, double> ours = colours_of(ours_->watch(450).led);
    const std::map<Led, double> theirs = colours_of(theirs_->watch(450).led);
    EXPECT_TRUE(!compares_led || std::equal(ours.begin(), ours.end(), theirs.begin(), theirs.end(),
                                            [](const auto& a, const auto& b) {
                                              return a.first == b.first &&
                                                     std::abs(a.second - b.second) < kSameMs;
                                            }))
        << "LED: ours " << text_of(ours) << ", kilolib's " << text_of(theirs);
    EXPECT_EQ(ours_->motors(), theirs_->motors());
    EXPECT_EQ(ours_->eeprom(), theirs_->eeprom());
    expect_same_registers();
  }

  void expect_same_registers() {
    for (const Register& which : registers()) {
      const unsigned differing = ours_->reg(which) ^ theirs_->reg(which);
      if (differing == 0) continue;
      const auto& list = listed_differences();
      const auto listed = std::find_if(list.begin(), list.end(), [&](const Difference& known) {
        return known.name == which.name;
      });
      const unsigned allowed = listed == list.end() ? 0 : listed->mask;
      EXPECT_EQ(differing & ~allowed, 0u) << which.name << ": ours " << int{ours_->reg(which)}
                                          << ", kilolib's " << int{theirs_->reg(which)};
      if (listed != list.end()) needed_.insert(listed->name);
    }
    // A timer that runs must be set alike: it is what the motors get.
    if (ours_->motors() != MotorPins{}) {
      for (const std::uint16_t address : kTimer2)
        EXPECT_EQ(ours_->mcu().data(address), theirs_->mcu().data(address)) << std::hex << address;
    }
  }

  std::unique_ptr<Bench> ours_, theirs_;
  bool has_voltage_shown_ = false;
  std::set<std::string_view> needed_;  // of the listed differences, those that were met
};

TEST_F(Judge, EachStateLooksTheSame) {
  for (const std::uint16_t battery : kBatteries) {
    for (const bool is_charging : {false, true}) {
      power_on(calibrated(), battery);
      for (Bench* robot : {ours_.get(), theirs_.get()}) robot->mcu().set_charging(is_charging);
      expect_same_state();
      for (const std::uint8_t type : {kVoltage, kCharge, kWakeup, kRun, kVoltage, kRun, kCharge,
                                      kRun, std::uint8_t{0x90}, kWakeup, kRun, kReset, kRun}) {
        SCOPED_TRACE(testing::Message() << "battery " << battery << ", message " << int{type});
        send(type);
      }
    }
  }
}

TEST_F(Judge, EachCallDoesTheSame) {
  power_on();
  send(kRun);
  for (const std::uint8_t left : kDuties)
    for (const std::uint8_t right : kDuties) call(Call::kSetMotors, {left, right});
  for (const Call move : {Call::kStop, Call::kTurnLeft, Call::kTurnRight, Call::kStraight,
                          Call::kTurnLeft, Call::kStop, Call::kStop, Call::kStraight})
    call(move);
  call(Call::kStop);
  for (std::uint8_t colour = 0; colour < 64; ++colour)
    call(Call::kSetColour,
         {static_cast<std::uint8_t>(colour & 3), static_cast<std::uint8_t>(colour >> 2 & 3),
          static_cast<std::uint8_t>(colour >> 4)});
  for (const Call question :
       {Call::kUid, Call::kTurnLeftDuty, Call::kTurnRightDuty, Call::kStraightLeft,
        Call::kStraightRight, Call::kLight, Call::kTemperature})
    call(question);
  for (const Call reading : {Call::kBattery, Call::kLight, Call::kTemperature})
    EXPECT_EQ(ours_->readings_of(reading), theirs_->readings_of(reading));
}

TEST_F(Judge, CalibrationMovesAndSavesTheSame) {
  power_on();
  const std::vector<std::vector<std::uint8_t>> steps = {{kModeLeft, 0, 0, 70},
                                                        {kModeLeft, 0, 0, 70},
                                                        {kModeLeft, 0, 0, 71},
                                                        {kModeSave},
                                                        {kModeRight, 0, 0, 0, 66},
                                                        {kModeLeft, 0, 0, 72},
                                                        {kModeUid, 0x39, 0x30},
                                                        {kModeLeft, 0, 0, 72},
                                                        {kModeStraight, 0, 0, 0, 0, 60, 66},
                                                        {kModeSave},
                                                        {kModeStraight, 0, 0, 0, 0, 61, 66},
                                                        {kModeStraight, 0, 0, 0, 0, 61, 0},
                                                        {kModeStraight, 0, 0, 0, 0, 0, 0},
                                                        {kModeLeft, 0, 0, 0},
                                                        {kModeRight, 0, 0, 0, 255},
                                                        {9, 1, 2, 3, 4, 5, 6},
                                                        {kModeSave},
                                                        {kModeSave},
                                                        {9, 1, 2, 3, 4, 5, 6}};
  for (const std::vector<std::uint8_t>& step : steps) {
    SCOPED_TRACE(testing::PrintToString(step));
    send(kCalibrate, step);
  }
  send(kRun);
  call(Call::kUid);
}

TEST_F(Judge, EachBitOfTheUidIsShownTheSame) {
  power_on();
  for (std::uint8_t bit = 0; bit < 18; ++bit) send(kReadUid, {bit});
  send(kReadUid, {255});
  send(kWakeup);
}

TEST_F(Judge, CalibrationInterruptsAProgramTheSame) {
  power_on();
  send(kRun);
  call(Call::kSetColour, {1, 2, 3});
  call(Call::kSetMotors, {50, 51});
  send(kCalibrate, {kModeRight, 0, 0, 0, 77});
  send(kRun);
  call(Call::kSetMotors, {52, 53});
  send(kReadUid, {1});
  send(kVoltage);
  send(kRun);
}

/// 24 messages in any order, ten times. Duties never repeat: kilolib does not move for a
/// calibration that equals the one before a pause (defects_not_repeated()).
TEST_F(Judge, AnyOrderOfMessagesDoesTheSame) {
  constexpr std::uint8_t kPlain[] = {kWakeup, kCharge, kVoltage, kRun, kReset};
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    emulator::Random chance(seed, 18);
    power_on(calibrated(), static_cast<std::uint16_t>(chance.happens(0.5) ? 700 : 620));
    std::uint8_t duty = 20;
    for (int i = 0; i < 24; ++i) {
      const auto kind = static_cast<std::uint8_t>(chance.below(10));
      std::vector<std::uint8_t> data;
      std::uint8_t type = kCalibrate;
      if (kind < 5) {
        type = kPlain[kind];
      } else if (kind == 5) {
        type = kReadUid;
        data = {static_cast<std::uint8_t>(chance.below(18))};
      } else {
        data = {static_cast<std::uint8_t>(kind - 6), 0x12, duty, duty, duty, duty, duty};
        duty = static_cast<std::uint8_t>(duty + 3);
        for (std::size_t byte = 4; byte < data.size(); ++byte)
          data[byte] = static_cast<std::uint8_t>(data[byte] + byte);
      }
      SCOPED_TRACE(testing::Message() << "seed " << seed << ", message " << i << ": " << int{type}
                                      << " " << testing::PrintToString(data));
      send(type, data);
      if (HasFailure()) return;
    }
  }
}

TEST_F(Judge, SleepAndWakingLookTheSame) {
  power_on();
  send(kRun);
  call(Call::kSetMotors, {70, 70});
  call(Call::kSetColour, {3, 0, 0});
  send(kSleep);
  EXPECT_EQ(ours_->motors(), MotorPins{});
  const std::map<Led, double> ours = colours_of(ours_->watch(9000).led);
  const std::map<Led, double> theirs = colours_of(theirs_->watch(9000).led);
  ASSERT_EQ(ours.size(), 1u);
  ASSERT_EQ(theirs.size(), 1u);
  EXPECT_EQ(ours.begin()->first, theirs.begin()->first);
  EXPECT_NEAR(ours.begin()->second, theirs.begin()->second, kSameMs);
}

TEST_F(Judge, EveryDistanceIsTheSameOnOneProcessor) {
  // The emulator's table, one like a real robot's, steep and then flat, and one that ends early.
  const std::vector<std::array<std::uint16_t, 28>> tables = {
      {1023, 993, 963, 933, 903, 873, 843, 813, 783, 753, 723, 693, 663, 633,
       900,  865, 830, 795, 760, 725, 690, 655, 620, 585, 550, 515, 480, 445},
      {1020, 1011, 1000, 985, 958, 920, 871, 810, 741, 660, 585, 512, 451, 396,
       845,  741,  640,  549, 472, 401, 345, 297, 256, 221, 190, 165, 144, 126},
      {980, 930, 871, 820, 760, 707, 651, 600, 552, 501, 449, 402, 350, 301,
       600, 598, 590, 570, 550, 500, 450, 300, 280, 260, 240, 200, 150, 149}};
  for (const auto& table : tables) {
    emulator::Eeprom eeprom = calibrated();
    for (std::size_t i = 0; i < 14; ++i) {
      eeprom[0x50 + 2 * i] = static_cast<std::uint8_t>(table[i] >> 8);
      eeprom[0x51 + 2 * i] = static_cast<std::uint8_t>(table[i]);
      eeprom[0x20 + 2 * i] = static_cast<std::uint8_t>(table[14 + i] >> 8);
      eeprom[0x21 + 2 * i] = static_cast<std::uint8_t>(table[14 + i]);
    }
    Bench robot(image_of("distance_kilolib"), eeprom);
    for (int second = 0; second < 60 && robot.variable("distance_is_done", 0, 1) == 0; ++second)
      robot.mcu().run_until(robot.mcu().cycle() + 1000 * Bench::kCyclesPerMs);
    ASSERT_EQ(robot.variable("distance_is_done", 0, 1), 1u);
    EXPECT_GT(robot.variable("distance_pairs", 0, 4), 8000u);
    EXPECT_EQ(robot.variable("distance_differences", 0, 4), 0u)
        << "first: high " << robot.variable("distance_first", 0) << ", low "
        << robot.variable("distance_first", 2) << ": ours " << robot.variable("distance_first", 4)
        << ", kilolib's " << robot.variable("distance_first", 6);
  }
}

TEST_F(Judge, EachListedDifferenceIsOne) {
  power_on();
  for (const std::uint8_t type : {kWakeup, kVoltage, kRun, kReset, kSleep}) send(type);
  for (const Difference& known : listed_differences())
    EXPECT_TRUE(needed_.contains(known.name)) << known.name << " is equal: take it off the list";
}

}  // namespace
}  // namespace swarmtalk::judge
