#include "platforms/sim/sim_robot.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "suite/programs/hop_count.hpp"
#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::platforms {
namespace {

using Robot = SimRobot<core::Kilobot>;
using Program = suite::HopCount<Robot>;

/// The paper's figure 5: 36 robots in a square, seeds in two corners, on the Kilobot's own memory.
TEST(SimRobot, HopCountFindsBothGradientsAt20PercentLoss) {
  sim::MediumConfig config;
  config.loss = 0.2;
  sim::Swarm<core::Kilobot> swarm(config, 1);
  std::vector<std::unique_ptr<Robot>> robots;
  std::vector<std::unique_ptr<Program>> programs;
  for (uint32_t i = 0; i < 36; ++i) {
    robots.push_back(std::make_unique<Robot>(swarm.add(i % 6, i / 6)));
    const auto role = i == 0    ? suite::HopCountRole::kSeed1
                      : i == 30 ? suite::HopCountRole::kSeed2
                                : suite::HopCountRole::kFollower;
    programs.push_back(std::make_unique<Program>(*robots.back(), role));
  }
  swarm.connect();
  for (auto& program : programs) program->setup();
  swarm.run_until(60'000'000);
  for (uint32_t i = 0; i < 36; ++i) {
    programs[i]->loop();
    const uint32_t x = i % 6, y = i / 6;
    EXPECT_EQ(programs[i]->hops(0), std::max(x, y));
    EXPECT_EQ(programs[i]->hops(1), std::max(x, 5 - y));
  }
  EXPECT_EQ(robots[0]->colour().green, 255);  // 0 and 5 hops: even and odd
}

}  // namespace
}  // namespace swarmtalk::platforms
