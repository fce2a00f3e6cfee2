// The example port runs every suite program, without a change to one.
#include "platforms/example/minimal_port.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "suite/programs/edge_following.hpp"
#include "suite/programs/firefly.hpp"
#include "suite/programs/hop_count.hpp"

namespace swarmtalk::platforms {
namespace {

struct Site {
  explicit Site(uint32_t seed, suite::HopCountRole role)
      : hardware{0, seed}, robot(hardware), program(robot, role) {}
  ExampleHardware hardware;
  ExampleRobot robot;
  suite::HopCount<ExampleRobot> program;
};

TEST(MinimalPort, RunsHopCountUnchanged) {
  std::vector<std::unique_ptr<Site>> line;
  for (uint32_t i = 0; i < 6; ++i) {
    line.push_back(std::make_unique<Site>(1000 + 7 * i, i == 0   ? suite::HopCountRole::kSeed1
                                                        : i == 5 ? suite::HopCountRole::kSeed2
                                                                 : suite::HopCountRole::kFollower));
    line.back()->program.setup();
  }
  for (uint32_t slot = 0; slot < 60; ++slot) {
    for (size_t i = 0; i < line.size(); ++i) {
      line[i]->hardware.timer_ticks = slot * 16;
      uint8_t frame[9];
      const uint16_t size = line[i]->robot.on_radio_ready(frame);
      if (i > 0) line[i - 1]->robot.on_radio_receive(frame, size, 50);
      if (i + 1 < line.size()) line[i + 1]->robot.on_radio_receive(frame, size, 50);
      line[i]->robot.poll();
      line[i]->program.loop();
    }
  }
  for (uint8_t i = 0; i < 6; ++i) {
    EXPECT_EQ(line[i]->program.hops(0), i);
    EXPECT_EQ(line[i]->program.hops(1), 5 - i);
  }
  EXPECT_EQ(line[1]->hardware.led.red, 255);  // 1 and 4 hops: odd and even
  EXPECT_EQ(line[1]->hardware.led.green, 0);
}

struct FireflySite {
  explicit FireflySite(uint32_t seed) : hardware{0, seed}, robot(hardware), program(robot) {
    program.setup();
  }
  ExampleHardware hardware;
  ExampleRobot robot;
  suite::Firefly<ExampleRobot> program;
};

TEST(MinimalPort, RunsFireflyUntilAllFlashTogether) {
  constexpr uint32_t kRobots = 4;
  constexpr uint32_t kPeriods = 60;
  std::vector<std::unique_ptr<FireflySite>> swarm;
  for (uint32_t i = 0; i < kRobots; ++i) {
    swarm.push_back(std::make_unique<FireflySite>(1000 + 77 * i));
  }
  uint32_t most_lit = 0;  // at once, in the last five periods
  for (uint32_t tick = 1; tick < kPeriods * 120; ++tick) {
    for (auto& site : swarm) site->hardware.timer_ticks = tick;
    for (uint32_t i = 0; i < kRobots; ++i) {
      uint8_t frame[9];
      if (tick % 16 != i * 4 || swarm[i]->robot.on_radio_ready(frame) == 0) continue;
      for (auto& other : swarm) {
        if (other != swarm[i]) other->robot.on_radio_receive(frame, 9, 50);
      }
    }
    uint32_t lit = 0;
    for (auto& site : swarm) {
      site->program.loop();
      lit += site->hardware.led.red != 0;
    }
    if (tick > (kPeriods - 5) * 120) most_lit = std::max(most_lit, lit);
  }
  EXPECT_EQ(most_lit, kRobots);
  for (auto& site : swarm) {
    EXPECT_NEAR(site->program.flashes(), kPeriods, 5);
    EXPECT_GT(site->robot.swarmtalk().counters().messages_received, 3 * 50);
  }
}

/// Flashes of `site` in `ticks` ticks of its clock.
uint32_t flashes_in(FireflySite& site, uint32_t ticks) {
  uint32_t flashes = 0;
  for (uint32_t i = 0; i < ticks; ++i) {
    const uint8_t before = site.program.flashes();
    ++site.hardware.timer_ticks;
    site.program.loop();
    flashes += site.program.flashes() != before;
  }
  return flashes;
}

TEST(MinimalPort, FireflyWhoseClockIsSetFlashesOnAtItsPeriod) {
  FireflySite site(1);
  EXPECT_NEAR(flashes_in(site, 1000), 8, 1);
  for (const int32_t step : {5000, -5000, 130, -130}) {
    site.hardware.timer_ticks += static_cast<uint32_t>(step);
    EXPECT_LE(flashes_in(site, 120), 2U) << step;
    EXPECT_NEAR(flashes_in(site, 1200), 10, 1) << step;
  }
}

TEST(MinimalPort, FireflyHasFlashedEvenAfter256Flashes) {
  FireflySite site(1);
  flashes_in(site, 240);
  for (uint32_t period = 0; period < 300; ++period) {
    flashes_in(site, 120);
    ASSERT_NE(site.program.flashes(), 0) << "it would not listen for a period";
  }
}

TEST(MinimalPort, RunsEdgeFollowingTowardsItsDistance) {
  for (int16_t distance_mm : {int16_t{50}, int16_t{60}, int16_t{80}}) {
    ExampleHardware hardware[2] = {{0, 5}, {0, 600}};
    ExampleRobot seed(hardware[0]);
    ExampleRobot follower(hardware[1]);
    suite::EdgeFollowing<ExampleRobot> stands(seed, suite::EdgeRole::kSeed, 1);
    suite::EdgeFollowing<ExampleRobot> walks(follower, suite::EdgeRole::kFollower, 2);
    stands.setup();
    walks.setup();
    bool did_left = false;
    bool did_right = false;
    bool did_ahead = false;
    for (uint32_t tick = 0; tick < 400; ++tick) {
      hardware[0].timer_ticks = hardware[1].timer_ticks = tick;
      uint8_t frame[9];
      if (tick % 16 == 0 && seed.on_radio_ready(frame) != 0) {
        follower.on_radio_receive(frame, 9, distance_mm);
      }
      if (tick % 16 == 8 && follower.on_radio_ready(frame) != 0) {
        seed.on_radio_receive(frame, 9, distance_mm);
      }
      follower.poll();
      stands.loop();
      walks.loop();
      const int8_t left = hardware[1].left_motor;
      const int8_t right = hardware[1].right_motor;
      did_left = did_left || (left == 0 && right == 1);
      did_right = did_right || (left == 1 && right == 0);
      did_ahead = did_ahead || (left == 1 && right == 1);
    }
    EXPECT_EQ(did_left, distance_mm == 50);
    EXPECT_EQ(did_right, distance_mm == 80);
    EXPECT_TRUE(did_ahead) << "a turn is followed by a step";
    EXPECT_EQ(hardware[0].led.blue, 255) << "the seed has its follower";
    EXPECT_EQ(hardware[0].led.red, 0);
  }
}

TEST(MinimalPort, EndsTimedMoves) {
  ExampleHardware hardware;
  ExampleRobot robot(hardware);
  robot.forward(10);
  hardware.timer_ticks = 9;
  robot.poll();
  EXPECT_TRUE(robot.is_moving());
  hardware.timer_ticks = 10;
  robot.poll();
  EXPECT_FALSE(robot.is_moving());
}

}  // namespace
}  // namespace swarmtalk::platforms
