// What redundancy brings and costs, in virtual time. benchmarks/redundancy.py prints all of it.
#include <gtest/gtest.h>

#include "tests/swarm/lossy_cell.hpp"

namespace swarmtalk::testing {
namespace {

CellResult run(const CellConfig& config) {
  const CellResult result = LossyCell(config).run();
  EXPECT_EQ(result.duplicates, 0u);
  EXPECT_EQ(result.damaged, 0u);
  EXPECT_EQ(result.shared, 0u) << "a repair packet shared a frame with what it protects";
  EXPECT_EQ(result.resent, 0u) << "a parity packet was sent on twice";
  return result;
}

CellConfig one_packet() {
  CellConfig config;
  config.seconds = 20;
  return config;
}

CellConfig four_packets() {
  CellConfig config;
  config.talkers = 1;
  config.robots = 11;
  config.message_bytes = 4 * 1383;
  config.rate_hz = 5;
  config.seconds = 60;
  return config;
}

TEST(RedundancyOfOnePacket, BringsTwentyPercentLossTo95PercentDeliveryForLittleAir) {
  for (const uint32_t bytes : {8u, 12u, 24u}) {
    CellConfig config = one_packet();
    config.message_bytes = bytes;
    const CellResult plain = run(config);
    EXPECT_NEAR(plain.delivery(), 0.80, 0.01);
    config.repairs = 1;
    const CellResult redundant = run(config);
    EXPECT_GE(redundant.delivery(), 0.95);
    EXPECT_LE(redundant.air_us_per_message(), 1.3 * plain.air_us_per_message());
    EXPECT_EQ(redundant.out_of_order, 0u);
  }
}

TEST(RedundancyOfOnePacket, GoesBesideCopies) {
  CellConfig config = one_packet();
  config.copies = 2;
  config.repairs = 1;
  EXPECT_GE(run(config).delivery(), 0.98);
}

TEST(RedundancyOfFourPackets, BringsTwentyPercentLossTo95PercentDeliveryForThreePacketsMore) {
  CellConfig config = four_packets();
  EXPECT_NEAR(run(config).delivery(), 0.41, 0.03);
  config.repairs = 3;
  const CellResult redundant = run(config);
  EXPECT_GE(redundant.delivery(), 0.95);
  EXPECT_LE(redundant.packets_per_message(), 1.75 * 4 + 1e-9);
  config.repairs = 0;
  config.is_automatic = true;
  const CellResult automatic = run(config);
  EXPECT_GE(automatic.delivery(), 0.95);
  EXPECT_LE(automatic.packets_per_message(), 1.75 * 4 + 1e-9);
}

TEST(RedundancyOfFourPackets, WorksWithTimestampsAndBesideCopies) {
  CellConfig config = four_packets();
  config.seconds = 20;
  config.repairs = 3;
  config.is_timestamped = true;
  config.message_bytes = 4 * 1379;
  EXPECT_GE(run(config).delivery(), 0.95);
  config.copies = 2;
  const CellResult both = run(config);
  EXPECT_GE(both.delivery(), 0.99);
  EXPECT_NEAR(both.packets_per_message(), 4 + 3 + 4, 0.01);
}

TEST(RedundancyOfFourPackets, IsSentOnOnceByEachAndReachesFarther) {
  CellConfig config = four_packets();
  config.robots = 8;
  config.line_reach = 2;
  config.ttl = 8;
  config.rate_hz = 2;
  config.seconds = 30;
  const CellResult plain = run(config);
  EXPECT_EQ(plain.forwarded, 0u);
  config.repairs = 3;
  const CellResult redundant = run(config);
  EXPECT_GT(redundant.forwarded, 0u);
  EXPECT_GT(redundant.delivery(), plain.delivery() + 0.1);
  EXPECT_LE(redundant.forwarded, redundant.sent * 3 * 7);
}

TEST(RedundancyOfFourPackets, DoesNotHarmRobotsThatDoNotKnowIt) {
  CellConfig config = four_packets();
  config.robots = 6;
  config.line_reach = 2;
  config.ttl = 6;
  config.rate_hz = 2;
  config.seconds = 30;
  config.old_robots_from = 1;
  const CellResult plain = run(config);
  config.repairs = 3;
  const CellResult redundant = run(config);
  EXPECT_NEAR(redundant.delivery(), plain.delivery(), 0.05);
  EXPECT_EQ(redundant.forwarded, 0u);
  EXPECT_GT(redundant.refused, 0u);
}

}  // namespace
}  // namespace swarmtalk::testing
