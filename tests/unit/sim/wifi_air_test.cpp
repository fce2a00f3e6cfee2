#include "sim/wifi_air.hpp"

#include <gtest/gtest.h>

#include <map>
#include <vector>

namespace swarmtalk::sim {
namespace {

constexpr uint64_t kSeed = 1;
constexpr std::size_t kPayloadBytes = 100;

/// A medium with stations, and what has arrived at whom.
class WifiAirTest : public testing::Test {
 protected:
  void make(const WifiAirConfig& config = {}, uint64_t seed = kSeed) {
    air.emplace(config, seed,
                WifiAir::Hooks{[this](uint32_t from, uint32_t to, std::span<const uint8_t>) {
                                 ++arrived[{from, to}];
                                 arrived_us[to] = air->now_us();
                                 return takes_frames;
                               },
                               [this](uint32_t, uint64_t at_us) { ended_us.push_back(at_us); }});
  }
  bool send(uint32_t station, uint64_t at_us) {
    return air->offer(station, std::vector<uint8_t>(14 + kPayloadBytes), at_us);
  }
  void expect_all_accounted() {
    const WifiAirCounters& counters = air->counters();
    uint64_t sum = counters.received;
    for (const WifiAirLoss& loss : wifi_air_losses()) sum += counters.*loss.count;
    EXPECT_EQ(sum, counters.expected);
    EXPECT_EQ(counters.expected, counters.sent * (air->size() - 1));
  }

  std::optional<WifiAir> air;
  std::map<std::pair<uint32_t, uint32_t>, int> arrived;
  std::map<uint32_t, uint64_t> arrived_us;
  std::vector<uint64_t> ended_us;
  bool takes_frames = true;
};

TEST(WifiAirTime, IsThatOfTheStandard) {
  // 136 bytes and 22 bits in symbols of 24 bits: 47 of 4 us, behind 20 us.
  EXPECT_EQ(wifi_air_time_us(wifi_rates().front(), 100), 208u);
  // 1500 + 36 bytes at 54 Mb/s: 12310 bits in symbols of 216.
  EXPECT_EQ(wifi_air_time_us(wifi_rates().back(), 1500), 20u + 4 * 57);
}

TEST_F(WifiAirTest, AFrameOnIdleAirArrivesAfterItsAirTime) {
  make();
  air->add(0, 0);
  air->add(40000, 0);
  EXPECT_TRUE(send(0, 1000));
  air->run(1207);
  EXPECT_TRUE(arrived.empty());
  air->run(1208);
  EXPECT_EQ((arrived[{0, 1}]), 1);
  EXPECT_EQ(arrived_us[1], 1208u);
  EXPECT_EQ(ended_us, std::vector<uint64_t>{1208});
  EXPECT_EQ(air->counters().air_us, 208u);
  expect_all_accounted();
}

TEST_F(WifiAirTest, WhoIsTooFarAwayHearsNothingAndIsCounted) {
  make();
  air->add(0, 0);
  air->add(50001, 0);
  air->add(0, 49999);
  send(0, 1000);
  air->run(10000);
  EXPECT_EQ(arrived.size(), 1u);
  EXPECT_EQ(air->counters(1).lost_range, 1u);
  EXPECT_EQ(air->counters(2).received, 1u);
  expect_all_accounted();
  air->move(1, 20000, 0);
  send(0, 11000);
  air->run(20000);
  EXPECT_EQ(air->counters(1).received, 1u);
}

TEST_F(WifiAirTest, WhoFindsTheAirTakenWaitsForDifsAndItsBackoff) {
  make();
  for (int i = 0; i < 3; ++i) air->add(1000 * i, 0);
  send(0, 1000);
  send(1, 1100);
  EXPECT_EQ(air->counters(1).deferred, 1u);
  air->run(5000);
  EXPECT_EQ(air->counters(2).received, 2u);
  ASSERT_EQ(ended_us.size(), 2u);
  const uint64_t started_us = ended_us[1] - 208;
  EXPECT_GE(started_us, 1208u + 34) << "DIFS";
  EXPECT_LE(started_us, 1208u + 34 + 15 * 9) << "DIFS and the longest backoff";
  EXPECT_EQ((started_us - 1208 - 34) % 9, 0u) << "whole slots";
  expect_all_accounted();
}

TEST_F(WifiAirTest, TwoWhoBeginTogetherAreNotHeardByWhoIsAsFarFromBoth) {
  make();
  air->add(-1000, 0);
  air->add(1000, 0);
  air->add(0, 1000);
  send(0, 1000);
  send(1, 1000);
  air->run(5000);
  EXPECT_EQ(air->counters(2).lost_collision, 2u);
  EXPECT_EQ(air->counters(0).lost_sending, 1u);
  EXPECT_EQ(air->counters(1).lost_sending, 1u);
  EXPECT_TRUE(arrived.empty());
  expect_all_accounted();
}

TEST_F(WifiAirTest, WhoBeginsBeforeTheFirstCanBeNoticedCollidesAndWhoIsLaterWaits) {
  for (const uint64_t after_us : {3u, 5u}) {
    make();
    air->add(0, 0);
    air->add(500, 0);  // so near that its energy alone is noticed
    send(0, 1000);
    send(1, 1000 + after_us);
    air->run(5000);
    EXPECT_EQ(air->counters().lost_sending, after_us < 4 ? 2u : 0u);
    EXPECT_EQ(air->counters().received, after_us < 4 ? 0u : 2u);
  }
}

TEST_F(WifiAirTest, TheMuchNearerOfTwoWhoBeginTogetherIsHeard) {
  make();
  air->add(1000, 0);
  air->add(20000, 0);
  air->add(0, 0);
  send(0, 1000);
  send(1, 1000);
  air->run(5000);
  EXPECT_EQ((arrived[{0, 2}]), 1);
  EXPECT_EQ(air->counters(2).lost_collision, 1u);
  expect_all_accounted();
}

TEST_F(WifiAirTest, WhoDoNotHearEachOtherCollideAtWhoStandsBetween) {
  make();
  air->add(-40000, 0);
  air->add(40000, 0);
  air->add(0, 0);
  send(0, 1000);
  send(1, 1100);  // in the middle of the other's frame, and hears nothing of it
  air->run(5000);
  EXPECT_EQ(air->counters(1).deferred, 0u);
  EXPECT_EQ(air->counters(2).lost_collision, 2u);
  expect_all_accounted();
}

TEST_F(WifiAirTest, LossIsByLinkAndDirection) {
  WifiAirConfig config;
  config.loss = 0.5;
  make(config);
  air->add(0, 0);
  air->add(1000, 0);
  air->add(0, 1000);
  air->set_link_loss(0, 1, 0.0);
  air->set_link_loss(0, 2, 0.3);
  for (uint64_t i = 1; i <= 2000; ++i) send(0, i * 1000);
  air->run(3000000);
  EXPECT_EQ(air->counters(1).received, 2000u);
  EXPECT_NEAR(static_cast<double>(air->counters(2).lost_link) / 2000, 0.3, 0.04);
  EXPECT_EQ(air->counters(2).lost_noise, 0u);
  air->set_link_loss(0, 2, std::nullopt);
  for (uint64_t i = 1; i <= 2000; ++i) send(0, 3000000 + i * 1000);
  air->run(6000000);
  EXPECT_NEAR(static_cast<double>(air->counters(2).lost_noise) / 2000, 0.5, 0.04);
  expect_all_accounted();
}

TEST_F(WifiAirTest, WhatFindsTheQueueFullIsDroppedAndCounted) {
  WifiAirConfig config;
  config.queue_frames = 3;
  make(config);
  air->add(0, 0);
  air->add(1000, 0);
  int taken = 0;
  for (int i = 0; i < 5; ++i) taken += send(0, 1000);
  EXPECT_EQ(taken, 3);
  EXPECT_EQ(air->counters().lost_queue_full, 2u);
  air->run(10000);
  EXPECT_EQ(air->counters(1).received, 3u);
  expect_all_accounted();
}

TEST_F(WifiAirTest, PartsHearOnlyThemselvesUntilTheyAreHealed) {
  make();
  for (int i = 0; i < 4; ++i) air->add(1000 * i, 0);
  air->set_group(0, 1);
  air->set_group(1, 1);
  send(0, 1000);
  send(2, 1050);  // does not hear 0, so does not wait
  air->run(5000);
  EXPECT_EQ(air->counters().deferred, 0u);
  EXPECT_EQ((arrived[{0, 1}]) + (arrived[{2, 3}]), 2);
  EXPECT_EQ(air->counters().received, 2u);
  EXPECT_EQ(air->counters().lost_partition, 4u);
  expect_all_accounted();
}

TEST_F(WifiAirTest, NothingIsReceivedInAJammersCircle) {
  make();
  for (int i = 0; i < 3; ++i) air->add(1000 * i, 0);
  Fault fault;
  fault.kind = Fault::Kind::kJam;
  fault.end_us = UINT64_MAX;
  fault.x_mm = 2000;
  fault.radius_mm = 500;
  air->interference().begin(fault);
  send(0, 1000);
  air->run(5000);
  EXPECT_EQ(air->counters(2).lost_jam, 1u);
  EXPECT_EQ(air->counters(1).received, 1u);
  air->interference().end(Fault::Kind::kJam);
  send(0, 6000);
  air->run(10000);
  EXPECT_EQ(air->counters(2).received, 1u);
  expect_all_accounted();
}

TEST_F(WifiAirTest, WhatAReceiverDoesNotTakeIsCounted) {
  make();
  air->add(0, 0);
  air->add(1000, 0);
  takes_frames = false;
  send(0, 1000);
  air->run(5000);
  EXPECT_EQ(air->counters().lost_receiver, 1u);
  expect_all_accounted();
}

TEST_F(WifiAirTest, FasterRatesTakeLessTimeAndDoNotReachAsFar) {
  WifiAirConfig config;
  config.rate_mbps = 54;
  make(config);
  air->add(0, 0);
  air->add(20000, 0);
  air->add(10000, 0);
  EXPECT_FALSE(air->is_in_range(0, 1));
  EXPECT_TRUE(air->is_in_range(0, 2));
  send(0, 1000);
  air->run(1000 + 20 + 4 * 6);
  EXPECT_EQ(air->counters(2).received, 1u);
  EXPECT_EQ(air->counters(1).lost_range, 1u);
}

TEST_F(WifiAirTest, ACrowdThatAlwaysSendsLosesToCollisionsAndTheSameSeedGivesTheSame) {
  const auto run = [this] {
    make();
    arrived.clear();
    for (int i = 0; i < 20; ++i) air->add(1000 * (i % 5), 1000 * (i / 5));
    for (uint64_t round = 1; round <= 200; ++round) {
      for (uint32_t i = 0; i < 20; ++i) send(i, round * 1000 + i * 37);
    }
    air->run(60000000);
    expect_all_accounted();
    return air->counters().received;
  };
  const uint64_t received = run();
  const WifiAirCounters counters = air->counters();
  EXPECT_GT(counters.lost_collision, counters.expected / 20);
  EXPECT_GT(received, counters.expected / 4);
  EXPECT_EQ(run(), received);
}

TEST_F(WifiAirTest, SaysWhenItsNextEventIs) {
  make();
  air->add(0, 0);
  air->add(1000, 0);
  EXPECT_FALSE(air->next_event_us(1000000));
  send(0, 1000);
  EXPECT_EQ(air->next_event_us(1000000), 1000u);
  air->run(1000);
  EXPECT_EQ(air->next_event_us(1000000), 1004u) << "the other notices the carrier";
  air->run(1004);
  EXPECT_FALSE(air->next_event_us(1100));
  EXPECT_EQ(air->next_event_us(1000000), 1208u);
  send(1, 1150);  // after a look ahead, an event in between is still possible
  air->run(5000);
  EXPECT_EQ(air->counters().received, 2u);
}

}  // namespace
}  // namespace swarmtalk::sim
