// How a Kilobot is wired and what its users' tools expect, in our own words: the table that robots
// of all makers share, since kilolib's programs, its overhead controller and the calibration in
// each robot's EEPROM depend on it. Checked against our image always, and against kilolib's where
// there is one (judge_test.cpp), so neither the firmware nor the emulator can agree with itself
// alone.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tests/kilobot/judge/bench.hpp"

namespace swarmtalk::judge {

constexpr std::uint8_t kBoot = 0x80, kReset = 0x83, kSleep = 0x84, kWakeup = 0x85, kCharge = 0x86;
constexpr std::uint8_t kVoltage = 0x87, kRun = 0x88, kReadUid = 0x89, kCalibrate = 0x8A;

/// Modes of CALIB, data[0]; uid in data[1..2], duties in data[3..6].
constexpr std::uint8_t kModeSave = 0, kModeUid = 1, kModeLeft = 2, kModeRight = 3,
                       kModeStraight = 4;

/// The left motor hangs on OC2A, pin PB3, and is the first of two wherever two duties are named. It
/// turns the robot left, counter-clockwise seen from above. The right one: OC2B, pin PD3.
struct MotorFact {
  const char* what;
  std::uint8_t type;
  std::vector<std::uint8_t> data;
  MotorPins push;  // for 15 ms
  MotorPins then;
  int turns;  // 1: left, -1: right, 0: straight
};

inline const std::vector<MotorFact>& motor_facts() {
  static const std::vector<MotorFact> facts = {
      {"CALIB turn left 70", kCalibrate, {kModeLeft, 0, 0, 70}, {255, 0}, {70, 0}, 1},
      {"CALIB turn right 66", kCalibrate, {kModeRight, 0, 0, 0, 66}, {0, 255}, {0, 66}, -1},
      {"CALIB straight 60 66",
       kCalibrate,
       {kModeStraight, 0, 0, 0, 0, 60, 66},
       {255, 255},
       {60, 66},
       0},
      {"READUID of a bit that is 1", kReadUid, {1}, {255, 0}, {71, 0}, 1},
  };
  return facts;
}
constexpr double kPushMs = 15;
constexpr double kPushErrorMs = 1.1;  // the interrupts that fall into it

/// A colour's level is a sum of two pins, weak and strong, that pull its LED to ground as outputs.
struct LedFact {
  const char* colour;
  std::uint16_t direction;  // address of DDRC or DDRD
  unsigned weak, strong;    // bits
};
constexpr std::array<LedFact, 3> kLedFacts = {
    {{"red", 0x2A, 5, 4}, {"green", 0x27, 3, 2}, {"blue", 0x27, 5, 4}}};

/// What the LED shows in a state, and for how long at a time; 0: all the time.
struct StateFact {
  const char* what;
  std::uint8_t type;
  std::uint16_t battery_counts;
  bool is_charging;
  Led shows;
  double lit_ms;
};
inline const std::vector<StateFact>& state_facts() {
  static const std::vector<StateFact> facts = {
      {"idle", kWakeup, 700, false, {0, 3, 0}, 1},
      {"battery full", kVoltage, 700, false, {0, 3, 0}, 0},
      {"battery good", kVoltage, 660, false, {0, 0, 3}, 0},
      {"battery low", kVoltage, 630, false, {3, 3, 0}, 0},
      {"battery empty", kVoltage, 600, false, {3, 0, 0}, 0},
      {"charging", kCharge, 700, true, {1, 0, 0}, 1},
      {"not on the charger", kCharge, 700, false, {0, 0, 0}, 0},
  };
  return facts;
}

/// Cells of EEPROM.
constexpr std::size_t kCellTurnLeft = 0x05, kCellTurnRight = 0x09, kCellStraightLeft = 0x0C;
constexpr std::size_t kCellStraightRight = 0x14, kCellTransmitPins = 0x90, kCellUid = 0xB0;

/// Pins of port B that light up, by the cell: any pin but 0, 1, 2, 6, 7 in it means PB0 alone.
struct TransmitFact {
  std::uint8_t cell, pins;
};
constexpr std::array<TransmitFact, 5> kTransmitFacts = {
    {{0xFF, 0x01}, {0x01, 0x01}, {0x42, 0x42}, {0xC7, 0xC7}, {0x0A, 0x01}}};

/// Readings and millimetres by the emulator's tables (1023 and 900 at touch, 30 and 35 less for
/// each 5 mm), each table rounded down and their mean rounded down again.
struct DistanceFact {
  std::uint16_t high, low;
  std::uint16_t mm;
};
constexpr std::array<DistanceFact, 9> kDistanceFacts = {{{1023, 901, 33},
                                                         {1000, 795, 48},
                                                         {899, 765, 52},
                                                         {850, 700, 61},
                                                         {800, 600, 72},
                                                         {701, 500, 86},
                                                         {650, 500, 95},
                                                         {513, 0, 118},
                                                         {950, 100, 123}}};

/// A single reading: channel and reference as in ADMUX, and the converter's clock.
struct ReadingFact {
  Call call;
  std::array<std::uint8_t, 2> reading;
};
constexpr std::array<ReadingFact, 3> kReadingFacts = {
    {{Call::kBattery, {6, 3}}, {Call::kLight, {7, 3}}, {Call::kTemperature, {0xC8, 7}}}};

}  // namespace swarmtalk::judge
