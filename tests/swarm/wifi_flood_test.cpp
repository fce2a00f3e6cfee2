// Floods in the wifi profile at the rate of a fast link, until its records have been given to other
// messages more than once: with an epoch and numbers that do not return nothing may be taken for
// something else. Seeds count from 1; all else is in a cell's name.
#include <gtest/gtest.h>

#include <ostream>

#include "tests/support/profiles.hpp"
#include "tests/swarm/everybody_floods.hpp"
#include "tests/swarm/fast_flood.hpp"
#include "tests/swarm/restart.hpp"

namespace swarmtalk::core::testing {
namespace {

using Robot = CoreRobot<ShortWifi>;
constexpr double kPacketTicks = 250;  // 4,000 packets a second

void expect_clean(const Counts& counts) {
  EXPECT_EQ(counts.duplicates, 0u);
  EXPECT_EQ(counts.own_back, 0u);
  EXPECT_EQ(counts.spliced, 0u);
  EXPECT_EQ(counts.id_collisions, 0u);
}

struct WifiCell {
  Place place;
  uint32_t robots;
  uint8_t packets;
  double relay_ticks;
  uint32_t messages;
};
std::ostream& operator<<(std::ostream& out, const WifiCell& cell) {
  const char* const places[] = {"crowd", "line", "grid"};
  return out << places[static_cast<int>(cell.place)] << " of " << cell.robots << ", "
             << static_cast<int>(cell.packets) << " packets, relays at " << cell.relay_ticks
             << " ticks";
}
FastFloodConfig config_of(const WifiCell& cell) {
  FastFloodConfig config;
  config.place = cell.place;
  config.robots = cell.robots;
  config.packets = cell.packets;
  config.ttl = 15;
  config.sender_ticks = kPacketTicks;
  config.relay_ticks = cell.relay_ticks;
  config.messages = cell.messages;
  return config;
}

class FastWifi : public ::testing::TestWithParam<WifiCell> {};

TEST_P(FastWifi, IsHeardByAllAndOnce) {
  const Counts counts = fast_flood<Robot>(config_of(GetParam()), 1);
  EXPECT_EQ(counts.messages, GetParam().messages);
  EXPECT_EQ(counts.delivered, counts.intended);
  expect_clean(counts);
}
constexpr uint32_t kTwiceAllRecords = 2 * ShortWifi::kRecords + 500;
INSTANTIATE_TEST_SUITE_P(
    All, FastWifi,
    ::testing::Values(
        WifiCell{Place::kCrowd, 2, 1, kPacketTicks, kTwiceAllRecords},
        WifiCell{Place::kCrowd, 6, 1, kPacketTicks, kTwiceAllRecords},
        WifiCell{Place::kCrowd, 6, 4, kPacketTicks, 2000},
        WifiCell{Place::kCrowd, 21, 1, kPacketTicks, 1000},
        // Slower relays hold their 256 packets and drop the rest: everybody hears the sender.
        WifiCell{Place::kCrowd, 6, 1, 8 * kPacketTicks, kTwiceAllRecords},
        WifiCell{Place::kCrowd, 6, 8, 8 * kPacketTicks, 1000},
        WifiCell{Place::kLine, 6, 1, kPacketTicks, kTwiceAllRecords},
        WifiCell{Place::kLine, 6, 4, kPacketTicks, 2000},
        WifiCell{Place::kGrid, 36, 1, kPacketTicks, 1000},
        WifiCell{Place::kGrid, 36, 8, kPacketTicks, 150}));

class WifiCrowd : public ::testing::TestWithParam<Timing> {};

/// With 5 % loss a packet that nobody repeats is lost to some: what is heard whole is delivered.
TEST_P(WifiCrowd, OfFloodingRobotsHearsEverythingOnce) {
  EverybodyConfig config;
  config.slot_ticks = kPacketTicks;
  config.ids = Ids::kFixed;
  config.timing = GetParam();
  for (double loss : {0.0, 0.05}) {
    config.loss = loss;
    for (double load : {0.5, 1.0}) {
      config.load = load;
      config.mixed_lengths = false;
      config.packets = 1;
      config.periods = 120;  // more messages than records
      const Counts counts = everybody_floods<Robot>(config, 1);
      ASSERT_GT(counts.messages, ShortWifi::kRecords);
      EXPECT_EQ(counts.delivered, counts.possible) << "load " << load << ", loss " << loss;
      if (loss == 0) {
        EXPECT_EQ(counts.delivered, counts.intended) << "load " << load;
      }
      expect_clean(counts);
    }
    config.mixed_lengths = true;
    config.load = 0.5;
    config.periods = 10;
    const Counts mixed = everybody_floods<Robot>(config, 2);
    EXPECT_EQ(mixed.delivered, mixed.possible) << "mixed lengths, loss " << loss;
    expect_clean(mixed);
  }
}
INSTANTIATE_TEST_SUITE_P(All, WifiCrowd, ::testing::Values(Timing::kBursts, Timing::kRandom));

/// The epoch tells a restart: numbers begin at 1 again, and not one message is taken for another.
TEST(WifiRestart, LosesNothingAnyNumberOfHopsOffAndSplicesNothing) {
  RestartConfig config;
  config.restarts = 30;
  config.slot_ticks = kPacketTicks;
  for (uint32_t receivers : {1u, 3u}) {
    config.receivers = receivers;
    for (uint8_t packets : {uint8_t{1}, uint8_t{4}}) {
      config.packets = packets;
      const RestartResult result = Restart<ShortWifi>(config).run();
      EXPECT_EQ(result.heard, result.intended) << static_cast<int>(packets) << " packets";
      EXPECT_EQ(result.counts.spliced, 0u);
      EXPECT_EQ(result.counts.duplicates, 0u);
    }
  }
}

}  // namespace
}  // namespace swarmtalk::core::testing
