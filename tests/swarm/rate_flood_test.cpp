// Floods that a stranger makes end, at the lowest rates that robots are given, whatever their
// messages allow: see docs/decisions/0037-floods-end.md.
#include "tests/swarm/rate_flood.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::core::testing {
namespace {

constexpr uint64_t kSeed = 1;

/// SWARMTALK_FLOOD_ROBOTS: more of them; 400 take two minutes of CPU.
uint32_t robots() {
  const char* const text = std::getenv("SWARMTALK_FLOOD_ROBOTS");
  return text == nullptr ? 40 : static_cast<uint32_t>(std::strtoul(text, nullptr, 10));
}

RateFloodConfig config() {
  RateFloodConfig config;
  config.robots = robots();
  config.seed = kSeed;
  return config;
}

TEST(RateFlood, EndsWithinTwiceTheTimeInWhichEachRobotSendsEachMessageOnce) {
  const RateFloodResult result = RateFlood<Wifi>(config()).run();
  EXPECT_GT(result.messages, 10'000u) << "more than a node has records for";
  EXPECT_LE(result.over_s, 2 * result.once_each_s) << "seed " << kSeed;
  // A record is given away before the last copy has passed. Lower it when that gets rarer.
  if (robots() == 40) {
    EXPECT_LE(result.most_repeats, 6u) << "seed " << kSeed;
  }
}

TEST(RateFlood, SendsEachMessageOnceWhereThereAreRecordsForAll) {
  RateFloodConfig few = config();
  few.robots = 40;
  few.flood_bytes_hz = 40e3;
  few.payload_bytes = 300;
  const RateFloodResult result = RateFlood<Wifi>(few).run();
  EXPECT_GT(result.messages, 1000u);
  EXPECT_LT(result.messages, uint32_t{Wifi::kRecords});
  EXPECT_EQ(result.most_repeats, 1u) << "seed " << kSeed;
}

TEST(RateFlood, EndsAfterATimeThatDoesNotDependOnTheNumberOfRobots) {
  RateFloodConfig few = config();
  few.payload_bytes = 1300;  // a frame each: what is waited for is longest
  const double bound_s = few.flood_s + few.max_ttl * (few.max_wait_us * 1e-6 + 2 / few.rate_hz);
  for (const uint32_t count : {10u, robots()}) {
    few.robots = count;
    const RateFloodResult result = RateFlood<Wifi>(few).run();
    EXPECT_LE(result.over_s, bound_s) << count << " robots, seed " << kSeed;
  }
}

TEST(RateFlood, WithoutLimitsGoesOn) {
  RateFloodConfig unlimited = config();
  unlimited.robots = 20;
  unlimited.payload_bytes = 1300;
  RateFloodConfig limited = unlimited;
  unlimited.max_wait_us = 0;
  EXPECT_GT(RateFlood<Wifi>(unlimited).run().over_s, 2 * RateFlood<Wifi>(limited).run().over_s);
}

}  // namespace
}  // namespace swarmtalk::core::testing
