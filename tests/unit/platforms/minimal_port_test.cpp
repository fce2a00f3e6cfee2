// The example port runs a suite program: a line of robots, each hearing the next.
#include "platforms/example/minimal_port.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

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
