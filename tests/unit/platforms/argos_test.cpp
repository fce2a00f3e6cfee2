// Robots in ARGoS without ARGoS: the logic that its controllers drive, joined with the suite's
// programs and with a small one, over an air that is a loop in this file.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "platforms/argos/joined.hpp"
#include "platforms/argos/line_of_sight.hpp"
#include "suite/programs/edge_following.hpp"
#include "suite/programs/firefly.hpp"
#include "suite/programs/hop_count.hpp"

namespace swarmtalk::platforms::in_argos {
namespace {

using Kilobot = ComparedProfile;
using W = core::Wire<Kilobot>;

/// Sends on channel 8 as often as it can, and moves as its role says.
template <class Robot>
class Mover {
 public:
  enum class Role : uint8_t { kStand, kAhead, kLeft, kRight };
  Mover(Robot& robot, Role role) : robot_(robot), role_(role) {}
  void setup() {
    auto* channel = robot_.swarmtalk().new_channel(8, 0, true);
    publisher_ = channel->new_publisher(static_cast<core::SentFn>(nullptr), nullptr);
    channel->new_subscriber(30000, &on_message, this);
    if (role_ == Role::kAhead) robot_.forward(10);
    if (role_ == Role::kLeft) robot_.left(0);
    if (role_ == Role::kRight) robot_.right(0);
  }
  void loop() {
    const uint8_t byte = 7;
    publisher_->send(&byte, 1);
  }

 private:
  static void on_message(void* self, const uint8_t*, uint16_t,
                         const core::Reception<typename Robot::Profile>& reception) {
    static_cast<Mover*>(self)->robot_.log("mm", reception.sensing.distance);
    static_cast<Mover*>(self)->robot_.log("delay", static_cast<int32_t>(reception.delay_ticks));
  }
  Robot& robot_;
  PublisherPointer<Robot> publisher_;
  Role role_;
};

template <class Model, template <class> class Program>
std::unique_ptr<SteppedRobot> make(uint32_t index, int role = 0, uint64_t seed = 1) {
  Settings settings;
  settings.seed = seed;
  settings.index = index;
  settings.role = role;
  auto robot = make_joined<Model, Program>(settings);
  robot->start_log();
  return robot;
}

/// A line of robots, 50 mm apart, each heard by its neighbours. @return all lines of the log
template <class Model, template <class> class Program>
std::string run_line(int robots, int steps, uint64_t seed = 1) {
  std::vector<std::unique_ptr<SteppedRobot>> line;
  for (int i = 0; i < robots; ++i) {
    line.push_back(make<Model, Program>(static_cast<uint32_t>(i), i == 0 ? 1 : 0, seed));
  }
  std::string log;
  for (int step = 1; step <= steps; ++step) {
    std::vector<std::vector<uint8_t>> air;  // what was wished for in the step before
    for (auto& robot : line) {
      air.emplace_back(robot->packet(), robot->packet() + robot->packet_bytes());
    }
    for (size_t i = 0; i < line.size(); ++i) {
      line[i]->begin(static_cast<uint64_t>(step), !air[i].empty());
      for (size_t other : {i - 1, i + 1}) {
        if (other >= air.size() || air[other].empty()) continue;
        line[i]->hear(air[other].data(), static_cast<uint16_t>(air[other].size()), 50, 0);
      }
      line[i]->run();
      log += line[i]->take_log();
    }
  }
  return log;
}

int count(const std::string& text, const std::string& word) {
  int found = 0;
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
  return found;
}

TEST(InArgos, HopCountCountsAlongALineOfBothRobots) {
  for (const std::string& log : {run_line<KilobotModel, suite::HopCountOneSeed>(5, 300),
                                 run_line<FootbotModel, suite::HopCountOneSeed>(5, 300)}) {
    for (int i = 0; i < 5; ++i) {
      const std::string robot = "\"robot\":" + std::to_string(i) + ",\"event\":\"value\"";
      const std::string last = log.substr(log.rfind(robot));
      EXPECT_EQ(last.find("\"name\":\"hops_1\",\"value\":" + std::to_string(i) + "}"),
                robot.size() + 1)
          << last.substr(0, 100);
    }
  }
}

TEST(InArgos, FirefliesFlashOncePerPeriodOnBothRobots) {
  const int flashes = count(run_line<KilobotModel, suite::Firefly>(2, 1200), "\"flash\"");
  EXPECT_GE(flashes, 18);
  EXPECT_LE(flashes, 22);
  EXPECT_GE(count(run_line<FootbotModel, suite::Firefly>(2, 1200), "\"flash\""), 18);
}

TEST(InArgos, AFollowerStepsAlongTheEdgeWhenItsSeedAnswers) {
  const std::string log = run_line<KilobotModel, suite::EdgeFollowing>(2, 300);
  EXPECT_GT(count(log, "\"robot\":0,\"event\":\"led\""), 3) << log;
}

/// Two seeds, of which the old one always speaks first when the follower has stopped: phases lock,
/// and did so for ten stops, until it ran into the other.
TEST(InArgos, AFollowerGoesOverToANearerSeedThatSpeaksWhileItMoves) {
  auto old_seed = make<KilobotModel, suite::EdgeFollowing>(0);
  auto near_seed = make<KilobotModel, suite::EdgeFollowing>(1);
  auto follower = make<KilobotModel, suite::EdgeFollowing>(2, 1);
  SteppedRobot* const all[] = {old_seed.get(), near_seed.get(), follower.get()};
  const auto is_moving = [&] {
    return follower->wheels().left_mm_per_s > 0 || follower->wheels().right_mm_per_s > 0;
  };
  const auto is_granted = [](const SteppedRobot& seed) {
    return seed.colour().red == 0 && seed.colour().blue == 255;
  };
  bool has_followed_the_old_one = false;
  for (uint64_t step = 1; step <= 310; ++step) {
    std::vector<std::vector<uint8_t>> air;
    for (auto* robot : all) {
      air.emplace_back(robot->packet(), robot->packet() + robot->packet_bytes());
    }
    const auto hear = [&](SteppedRobot& receiver, size_t from, double distance_mm) {
      if (air[from].empty()) return;
      receiver.hear(air[from].data(), static_cast<uint16_t>(air[from].size()), distance_mm, 0);
    };
    for (size_t i = 0; i < 3; ++i) all[i]->begin(step, !air[i].empty());
    hear(*old_seed, 2, 60);
    hear(*near_seed, 2, 45);
    if (is_moving()) {
      hear(*follower, 1, 45);
    } else {
      hear(*follower, 0, 60);
    }
    for (auto* robot : all) robot->run();
    has_followed_the_old_one |= is_granted(*old_seed);
  }
  EXPECT_TRUE(has_followed_the_old_one);
  EXPECT_TRUE(is_granted(*near_seed));
}

TEST(InArgos, TheSameSeedGivesTheSameLogAndAnotherOneAnother) {
  const auto run = [](uint64_t seed) {
    return run_line<KilobotModel, suite::Firefly>(3, 400, seed);
  };
  EXPECT_EQ(run(5), run(5));
  EXPECT_NE(run(5), run(6));
}

TEST(InArgos, LeftIsLeftAndAMoveEndsAfterItsTicks) {
  auto ahead = make<KilobotModel, Mover>(0, 1);
  int moving = 0;
  for (uint64_t step = 1; step <= 30; ++step) {
    ahead->begin(step, false);
    ahead->run();
    moving += ahead->wheels().left_mm_per_s > 0 && ahead->wheels().right_mm_per_s > 0;
  }
  EXPECT_EQ(moving, 10);
  for (const bool is_left : {true, false}) {
    auto kilobot = make<KilobotModel, Mover>(0, is_left ? 2 : 3);
    auto footbot = make<FootbotModel, Mover>(0, is_left ? 2 : 3);
    for (SteppedRobot* robot : {kilobot.get(), footbot.get()}) {
      robot->begin(1, false);
      const double turn = robot->wheels().right_mm_per_s - robot->wheels().left_mm_per_s;
      EXPECT_EQ(turn > 0, is_left) << robot->platform() << ": left turns counterclockwise";
    }
  }
}

TEST(InArgos, DistancesAreCutOffAndNeverWrapped) {
  EXPECT_EQ(clamped_mm(-3), 0);
  EXPECT_EQ(clamped_mm(260), 260) << "a byte would say 4";
  EXPECT_EQ(clamped_mm(59.6), 60);
  EXPECT_EQ(clamped_mm(1e9), 32767);
  EXPECT_EQ(clamped_mm(std::numeric_limits<double>::infinity()), 32767);
  EXPECT_EQ(clamped_mm(std::nan("")), -1) << "unknown";
}

TEST(InArgos, AnUnknownDistancePassesAllLimits) {
  auto sender = make<KilobotModel, Mover>(1);
  auto receiver = make<KilobotModel, Mover>(2);
  uint64_t step = 0;
  while (sender->packet_bytes() == 0 && step < 50) {
    sender->begin(++step, false);
    sender->run();
  }
  receiver->begin(step + 1, false);
  receiver->hear(sender->packet(), sender->packet_bytes(), std::nan(""), 0);
  EXPECT_EQ(count(receiver->take_log(), "\"name\":\"mm\",\"value\":-1"), 1);
}

TEST(InArgos, APacketThatWaitsForTheAirGrowsOlderStepByStep) {
  auto sender = make<KilobotModel, Mover>(1);
  uint64_t step = 0;
  while (sender->packet_bytes() == 0 && step < 50) {
    sender->begin(++step, false);
    sender->run();
  }
  ASSERT_EQ(sender->packet_bytes(), W::kMtuBytes);
  const auto delay = [&] {
    EXPECT_EQ(W::check(sender->packet(), sender->packet_bytes()), core::Error::kOk);
    return W::timestamp(sender->packet(),
                        static_cast<W::PacketSize>(W::kMtuBytes - W::kChecksumBytes));
  };
  const auto first = delay();
  for (int waited = 1; waited <= 20; ++waited) {
    sender->begin(++step, false);
    sender->run();
    EXPECT_EQ(delay(), first + waited);
  }
}

TEST(InArgos, ARobotSendsEveryThreeToFiveStepsAndNotInStepWithOthers) {
  std::vector<uint64_t> patterns;
  for (uint32_t index = 0; index < 20; ++index) {
    auto robot = make<KilobotModel, Mover>(index);
    uint64_t last = 0;
    uint64_t pattern = 0;
    bool was_sent = false;
    for (uint64_t step = 1; step <= 60; ++step) {
      robot->begin(step, was_sent);
      robot->run();
      was_sent = robot->packet_bytes() != 0;
      pattern = pattern << 1 | (was_sent ? 1 : 0);
      if (!was_sent) continue;
      if (last != 0) {
        EXPECT_GE(step - last, 3u);
        EXPECT_LE(step - last, 6u);
      }
      last = step;
    }
    EXPECT_NE(last, 0u);
    patterns.push_back(pattern);
  }
  std::sort(patterns.begin(), patterns.end());
  EXPECT_EQ(std::unique(patterns.begin(), patterns.end()), patterns.end());
}

TEST(InArgos, NothingIsHeardBeforeARobotIsSwitchedOn) {
  Settings settings;
  settings.power_on_spread_us = 10000000;
  auto robot = make_joined<KilobotModel, Mover>(settings);
  robot->start_log();
  std::string log;
  uint64_t step = 0;
  while (log.empty() && step < 400) {
    robot->begin(++step, false);
    const uint8_t nonsense[9] = {};
    robot->hear(nonsense, 9, 10, 0);
    robot->run();
    log = robot->take_log();
  }
  EXPECT_GT(step, 1u) << "seed 1 draws a later one";
  EXPECT_LE(step, 311u);
  EXPECT_EQ(log.find("\"event\":\"start\",\"node\":0"), log.find("\"event\""));
}

TEST(LineOfSight, OnlyFootbotsStandInTheWay) {
  const std::vector<Standing> row = {{0, 0, 860}, {300, 0, 860}, {600, 0, 860}, {600, 300, 860}};
  EXPECT_EQ(listeners(row, 0, 0), (std::vector<uint32_t>{1, 2, 3}));
  EXPECT_EQ(listeners(row, 0, 170), (std::vector<uint32_t>{1, 3})) << "134 mm past the second";
}

TEST(LineOfSight, TheRangeIsThatOfTheSender) {
  const std::vector<Standing> pair = {{0, 0, 75}, {70, 0, 60}};
  EXPECT_EQ(listeners(pair, 0, 0), (std::vector<uint32_t>{1}));
  EXPECT_TRUE(listeners(pair, 1, 0).empty());
}

TEST(LineOfSight, WhoStandsBehindOneOfTheTwoHidesNothing) {
  const std::vector<Standing> row = {{0, 0, 400}, {300, 0, 400}, {600, 0, 400}};
  EXPECT_EQ(listeners(row, 1, 170), (std::vector<uint32_t>{0, 2}));
}

Experiment sound() {
  return {31, {-1, -1}, {1, 1}, {{"robot0", 0, 0, 0.075, true}, {"robot1", 0.05, 0, 0.86, false}}};
}

TEST(ExperimentFile, ASoundOneIsNotComplainedAbout) {
  EXPECT_EQ(complaint_about(sound()), "");
}

TEST(ExperimentFile, WhatIsWrongIsToldInOneLine) {
  struct Case {
    void (*spoil)(Experiment&);
    const char* says;
  };
  const Case cases[] = {
      {[](Experiment& e) { e.steps_per_second = 10; }, "write ticks_per_second=\"31\""},
      {[](Experiment& e) { e.arena_max[1] = -0.5; }, "the arena is 0.5 m wide"},
      {[](Experiment& e) { e.robots[1].x = 50; }, "robot1 stands at 50,0 m, outside the arena"},
      {[](Experiment& e) { e.robots[0].range = 7.5; }, "a radio range of 7.5 m, at most 1 make"},
      {[](Experiment& e) { e.robots[1].range = 86; }, "a radio range of 86 m, at most 20 make"},
      {[](Experiment& e) { e.robots[1].range = std::nan(""); }, "a radio range of nan m"},
      {[](Experiment& e) { e.robots[1].name = "robot0"; }, "two robots are called robot0"}};
  for (const Case& each : cases) {
    Experiment experiment = sound();
    each.spoil(experiment);
    const std::string says = complaint_about(experiment);
    EXPECT_NE(says.find(each.says), std::string::npos) << says;
    EXPECT_EQ(says.find('\n'), std::string::npos);
  }
}

TEST(ExperimentFile, AttributesOfAControllerAreTaken) {
  Settings settings;
  EXPECT_EQ(take_attribute(settings, "index", "7"), "");
  EXPECT_EQ(take_attribute(settings, "role", "2"), "");
  EXPECT_EQ(take_attribute(settings, "random_id", "true"), "");
  EXPECT_EQ(take_attribute(settings, "drift_ppm", "5000"), "");
  EXPECT_EQ(take_attribute(settings, "power_on_spread_us", "500000"), "");
  EXPECT_EQ(settings.index, 7u);
  EXPECT_EQ(settings.role, 2);
  EXPECT_TRUE(settings.has_random_id);
  EXPECT_EQ(settings.drift_ppm, 5000u);
  EXPECT_EQ(settings.power_on_spread_us, 500'000u);
}

TEST(ExperimentFile, AnAttributeWithoutSenseIsNamedWithItsValue) {
  const char* const cases[][2] = {{"index", "one"},
                                  {"index", "-1"},
                                  {"index", "99999999999"},
                                  {"role", "seed"},
                                  {"role", "1.5"},
                                  {"role", "256"},
                                  {"drift_ppm", "nan"},
                                  {"drift_ppm", "2000000"},
                                  {"power_on_spread_us", "-5"},
                                  {"power_on_spread_us", "4294967291"},
                                  {"random_id", "maybe"},
                                  {"index", ""},
                                  {"index", "7 "}};
  for (const auto& [name, value] : cases) {
    Settings settings;
    const std::string says = take_attribute(settings, name, value);
    EXPECT_NE(says.find(std::string(name) + "=\"" + value + "\""), std::string::npos) << says;
  }
  Settings settings;
  EXPECT_NE(take_attribute(settings, "indx", "1").find("no attribute 'indx'"), std::string::npos);
}

}  // namespace
}  // namespace swarmtalk::platforms::in_argos
