// What nodes make of mishaps: losses among floods of all lengths, restarts, senders that draw their
// numbers, nodes that are not called. Shorter runs than benchmarks/core/mishap_table prints. Seeds
// count from 1; all else is in a test's name.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ostream>

#include "swarmtalk/profiles/classic2020.hpp"
#include "tests/support/profiles.hpp"
#include "tests/swarm/everybody_floods.hpp"
#include "tests/swarm/old_sender.hpp"
#include "tests/swarm/pauses.hpp"
#include "tests/swarm/restart.hpp"

namespace swarmtalk::core::testing {
namespace {

using Profiles = ::testing::Types<Kilobot, Footbot, FloodRoom>;

// --- splices ----------------------------------------------------------------------------------

template <class P>
class LossyCrowd : public ::testing::Test {};
TYPED_TEST_SUITE(LossyCrowd, Profiles);

TYPED_TEST(LossyCrowd, SplicesNothingUnderDistinctIds) {
  EverybodyConfig config;
  config.mixed_lengths = true;
  config.loss = 0.2;
  config.periods = 2;
  config.ids = Ids::kFixed;
  for (Timing timing : {Timing::kBursts, Timing::kRandom}) {
    config.timing = timing;
    const Counts counts = everybody_floods<CoreRobot<TypeParam>>(config, 60);
    ASSERT_GT(counts.delivered, 10000u);
    EXPECT_EQ(counts.spliced, 0u);
  }
}

// --- restarts ---------------------------------------------------------------------------------

struct RestartSum {
  double least_heard = 1;
  double predicted = 0;
  uint64_t spliced = 0;
};
/// Over paces and lengths.
template <class P>
RestartSum restarts(uint32_t receivers) {
  RestartConfig config;
  config.restarts = 100;
  config.receivers = receivers;
  config.least_pause_ticks = 9;  // shorter, and a link may have repeated a packet
  RestartSum sum;
  for (double slot_ticks : {2.0, 16.0}) {
    for (uint8_t packets : {uint8_t{1}, uint8_t{4}, uint8_t{8}}) {
      config.slot_ticks = slot_ticks;
      config.packets = packets;
      const RestartResult result = Restart<P>(config).run();
      sum.least_heard = std::min(sum.least_heard, result.share_heard());
      sum.predicted += result.splices_predicted;
      sum.spliced += result.counts.spliced;
    }
  }
  std::printf("heard %.4f; spliced %llu, predicted %.1f\n", sum.least_heard,
              static_cast<unsigned long long>(sum.spliced), sum.predicted);
  return sum;
}

template <class P>
class RestartedSender : public ::testing::Test {};
TYPED_TEST_SUITE(RestartedSender, Profiles);

TYPED_TEST(RestartedSender, IsHeardByANeighbour) {
  EXPECT_GE(restarts<TypeParam>(1).least_heard, 0.99);
}
/// Whose first packets a forwarder brings, cannot tell up to eight numbers from copies.
TYPED_TEST(RestartedSender, IsHeardOverThreeHopsButForNumbersThatWereJustUsed) {
  EXPECT_GE(restarts<TypeParam>(3).least_heard, 0.86);
}
/// Bad luck with sixteen numbers; restart.hpp says how much of it.
TYPED_TEST(RestartedSender, SplicesNoMoreThanPredicted) {
  const RestartSum sum = restarts<TypeParam>(1);
  EXPECT_LE(static_cast<double>(sum.spliced), sum.predicted + 3 * std::sqrt(sum.predicted));
}

// --- senders that draw their numbers ----------------------------------------------------------

template <class P>
class SenderOf2020 : public ::testing::Test {};
using OldProfiles = ::testing::Types<Kilobot, Classic2020, FloodRoom>;
TYPED_TEST_SUITE(SenderOf2020, OldProfiles);

TYPED_TEST(SenderOf2020, IsHeardThoughItsNumbersComeBackAtOnce) {
  OldSenderConfig config;
  config.messages = 2000;
  for (double sender_ticks : {16.0, 64.0}) {
    for (uint32_t receivers : {1u, 5u}) {
      config.sender_ticks = sender_ticks;
      config.receivers = receivers;
      const Counts counts = old_sender<TypeParam>(config);
      EXPECT_GE(counts.delivered_of_all(), 0.95)
          << receivers << " receivers at " << sender_ticks << " ticks";
      EXPECT_LE(counts.duplicates_per_delivery(), 0.01)
          << receivers << " receivers at " << sender_ticks << " ticks";
    }
  }
}

// --- pauses -----------------------------------------------------------------------------------

struct PauseCell {
  double pause_ticks;
  uint8_t ttl;
  double slot_ticks;
};
std::ostream& operator<<(std::ostream& out, const PauseCell& cell) {
  return out << cell.pause_ticks << " ticks, TTL " << static_cast<int>(cell.ttl) << ", "
             << cell.slot_ticks << " ticks per packet";
}
/// In a pause of 100 or 300 ticks sixteen messages of a fast flood may pass unheard, and a
/// forwarder's packet completes the one that was cut: mishap_table prints how often.
std::vector<PauseCell> pause_cells(uint8_t ttl) {
  std::vector<PauseCell> cells;
  for (double slot_ticks : {2.0, 16.0}) {
    for (double pause_ticks : {100.0, 300.0, 65560.0, 70000.0, 1e6}) {
      if (ttl == 0 || pause_ticks > 1000) cells.push_back({pause_ticks, ttl, slot_ticks});
    }
  }
  return cells;
}
template <class P>
uint64_t spliced_around(const PauseCell& cell) {
  PauseConfig config;
  config.pause_ticks = cell.pause_ticks;
  config.ttl = cell.ttl;
  config.senders = cell.ttl == 0 ? 3 : 1;
  config.slot_ticks = cell.slot_ticks;
  config.pauses = cell.pause_ticks < 1000 ? 500 : cell.pause_ticks < 100000 ? 40 : 4;
  return pauses<P>(config).spliced;
}

class PausedRobot : public ::testing::TestWithParam<PauseCell> {};

TEST_P(PausedRobot, SplicesNothingWithAKilobotsMemory) {
  EXPECT_EQ(spliced_around<Kilobot>(GetParam()), 0u);
}
TEST_P(PausedRobot, SplicesNothingWithAFootbotsMemory) {
  EXPECT_EQ(spliced_around<Footbot>(GetParam()), 0u);
}
TEST_P(PausedRobot, SplicesNothingWithMemoryForAll) {
  EXPECT_EQ(spliced_around<FloodRoom>(GetParam()), 0u);
}
INSTANTIATE_TEST_SUITE_P(OneHop, PausedRobot, ::testing::ValuesIn(pause_cells(0)));
INSTANTIATE_TEST_SUITE_P(Floods, PausedRobot, ::testing::ValuesIn(pause_cells(3)));

/// Numbers come back every 64 ticks here, and an 8-bit stamp after 256.
TEST(SeldomCalledRobot, SplicesNothing) {
  PauseConfig config;
  config.pause_ticks = 84;
  config.awake_ticks = 2;
  config.packets = 2;
  config.pauses = 1000;
  EXPECT_EQ(pauses<Kilobot>(config).spliced, 0u);
}

}  // namespace
}  // namespace swarmtalk::core::testing
