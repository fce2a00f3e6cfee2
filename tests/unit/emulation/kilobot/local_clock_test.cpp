#include "emulation/kilobot/local_clock.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::emulator {
namespace {

TEST(LocalClock, CountsEightCyclesPerMicrosecond) {
  const LocalClock clock(1000, 8'000'000, 0);
  EXPECT_EQ(clock.cycle_at(500), 0u);
  EXPECT_EQ(clock.cycle_at(1000), 0u);
  EXPECT_EQ(clock.cycle_at(2000), 8u);
  EXPECT_NEAR(static_cast<double>(clock.cycle_at(1000 + 3'600'000'000'000)), 28.8e9, 10);
}

TEST(LocalClock, RunsFastOrSlowByItsDrift) {
  const LocalClock fast(0, 8'000'000, 10'000), slow(0, 8'000'000, -10'000);
  EXPECT_NEAR(static_cast<double>(fast.cycle_at(1'000'000'000)), 8'080'000, 1);
  EXPECT_NEAR(static_cast<double>(slow.cycle_at(1'000'000'000)), 7'920'000, 1);
}

TEST(LocalClock, HasReachedACycleAtItsTime) {
  for (const double drift_ppm : {-9'999.0, 0.0, 1.0, 8'881.0}) {
    const LocalClock clock(12'345, 8'000'000, drift_ppm);
    for (std::uint64_t cycle = 0; cycle < 1'000'000; cycle += 997) {
      EXPECT_EQ(clock.cycle_at(clock.time_of_ns(cycle)), cycle);
      if (cycle > 0) {
        EXPECT_LT(clock.cycle_at(clock.time_of_ns(cycle) - 1), cycle);
      }
    }
  }
}

}  // namespace
}  // namespace swarmtalk::emulator
