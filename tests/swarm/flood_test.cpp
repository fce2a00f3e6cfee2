// Floods that are fast, go far, or come from everybody: what must hold, in shorter runs than those
// that benchmarks/core/flood_table prints. Seeds count from 1; all else is in a cell's name.
#include <gtest/gtest.h>

#include <ostream>

#include "tests/support/profiles.hpp"
#include "tests/swarm/everybody_floods.hpp"
#include "tests/swarm/fast_flood.hpp"
#include "tests/swarm/ideal_robot.hpp"

namespace swarmtalk::core::testing {
namespace {

enum class Node { kKilobot, kFootbot };

void expect_clean(const Counts& counts) {
  EXPECT_EQ(counts.duplicates, 0u);
  EXPECT_EQ(counts.own_back, 0u);
  EXPECT_EQ(counts.spliced, 0u);
  EXPECT_EQ(counts.id_collisions, 0u);
}

Counts run(Node node, const FastFloodConfig& config) {
  return node == Node::kKilobot ? fast_flood<CoreRobot<Kilobot>>(config, 2)
                                : fast_flood<CoreRobot<Footbot>>(config, 2);
}
/// Longer than the records of floods live.
uint32_t messages_for(Node node, const FastFloodConfig& config) {
  const double ticks = node == Node::kKilobot ? 2500 : 5000;
  return static_cast<uint32_t>(ticks / (config.sender_ticks * config.packets));
}

// --- at the link's own rate -------------------------------------------------------------------

struct FastCell {
  Node node;
  uint32_t receivers;
  double relay_ticks;
  uint8_t packets;
};
std::ostream& operator<<(std::ostream& out, const FastCell& cell) {
  return out << (cell.node == Node::kKilobot ? "Kilobot, " : "Foot-bot, ") << cell.receivers
             << " receivers, relays at " << cell.relay_ticks << " ticks, "
             << static_cast<int>(cell.packets) << " packets";
}
std::vector<FastCell> fast_cells(std::initializer_list<uint32_t> receivers) {
  std::vector<FastCell> cells;
  for (Node node : {Node::kKilobot, Node::kFootbot}) {
    for (uint32_t count : receivers) {
      for (double relay_ticks : {2.0, 16.0}) {
        for (uint8_t packets : {uint8_t{1}, uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
          cells.push_back({node, count, relay_ticks, packets});
        }
      }
    }
  }
  return cells;
}
FastFloodConfig fast(const FastCell& cell) {
  FastFloodConfig config;
  config.robots = cell.receivers + 1;
  config.packets = cell.packets;
  config.relay_ticks = cell.relay_ticks;
  config.sender_ticks = cell.node == Node::kKilobot ? 2 : 1;
  config.messages = messages_for(cell.node, config);
  config.ids = Ids::kDistinct;
  return config;
}

class FastFloodCell : public ::testing::TestWithParam<FastCell> {};

TEST_P(FastFloodCell, IsHeardByAllAndOnce) {
  const Counts counts = run(GetParam().node, fast(GetParam()));
  EXPECT_GE(counts.delivered_of_all(), 0.99);
  expect_clean(counts);
}
INSTANTIATE_TEST_SUITE_P(All, FastFloodCell, ::testing::ValuesIn(fast_cells({1, 5, 20})));

class FastPair : public ::testing::TestWithParam<FastCell> {};

TEST_P(FastPair, OfSendersHearsEachOtherAndNeverItself) {
  FastFloodConfig config = fast(GetParam());
  config.all_send = true;
  const Counts counts = run(GetParam().node, config);
  EXPECT_GE(counts.delivered_of_all(), 0.99);
  expect_clean(counts);
}
INSTANTIATE_TEST_SUITE_P(All, FastPair, ::testing::ValuesIn(fast_cells({1})));

class LossyFastFlood : public ::testing::TestWithParam<FastCell> {};

/// Relays that are slower than the sender hold copies from sixteen messages ago and more, which
/// four bits cannot tell from what was lost of the present one.
TEST_P(LossyFastFlood, SplicesNothingAtTheRelaysOwnPace) {
  FastFloodConfig config = fast(GetParam());
  config.sender_ticks = config.relay_ticks;
  config.messages = messages_for(GetParam().node, config);
  config.ids = Ids::kFixed;
  for (double loss : {0.05, 0.2}) {
    config.loss = loss;
    const Counts counts = run(GetParam().node, config);
    EXPECT_EQ(counts.spliced, 0u) << "loss " << loss << ", of " << counts.delivered;
  }
}
INSTANTIATE_TEST_SUITE_P(All, LossyFastFlood, ::testing::ValuesIn(fast_cells({1, 5, 20})));

// --- several hops -----------------------------------------------------------------------------

struct HopsCell {
  Node node;
  Place place;
  double ticks;
  double jitter;
};
std::ostream& operator<<(std::ostream& out, const HopsCell& cell) {
  return out << (cell.node == Node::kKilobot ? "Kilobot, " : "Foot-bot, ")
             << (cell.place == Place::kLine ? "line" : "grid") << ", " << cell.ticks
             << " ticks, jitter " << cell.jitter;
}
std::vector<HopsCell> hops_cells() {
  std::vector<HopsCell> cells;
  for (Node node : {Node::kKilobot, Node::kFootbot}) {
    for (Place place : {Place::kLine, Place::kGrid}) {
      for (double ticks : {node == Node::kKilobot ? 2.0 : 1.0, 16.0}) {
        for (double jitter : {0.0, 0.1}) cells.push_back({node, place, ticks, jitter});
      }
    }
  }
  return cells;
}

FastFloodConfig hops(const HopsCell& cell, uint8_t packets) {
  FastFloodConfig config;
  config.place = cell.place;
  config.robots = config.place == Place::kLine ? 6 : 36;
  config.packets = packets;
  config.ttl = 15;
  config.sender_ticks = config.relay_ticks = cell.ticks;
  config.jitter = cell.jitter;
  config.messages = messages_for(cell.node, config);
  return config;
}

class SeveralHops : public ::testing::TestWithParam<HopsCell> {};

TEST_P(SeveralHops, CarryWhatComesAtTheRelaysOwnPace) {
  for (uint8_t packets : {uint8_t{1}, uint8_t{4}}) {
    const Counts counts = run(GetParam().node, hops(GetParam(), packets));
    EXPECT_GE(counts.delivered_of_all(), 0.99) << static_cast<int>(packets) << " packets";
    expect_clean(counts);
  }
}
INSTANTIATE_TEST_SUITE_P(All, SeveralHops, ::testing::ValuesIn(hops_cells()));

// --- everybody floods -------------------------------------------------------------------------

struct CrowdCell {
  Timing timing;
  double load;
  uint8_t packets;
};
std::ostream& operator<<(std::ostream& out, const CrowdCell& cell) {
  return out << (cell.timing == Timing::kBursts ? "bursts" : "random") << ", load " << cell.load
             << ", " << static_cast<int>(cell.packets) << " packets";
}
std::vector<CrowdCell> crowd_cells(std::initializer_list<double> loads) {
  std::vector<CrowdCell> cells;
  for (Timing timing : {Timing::kBursts, Timing::kRandom}) {
    for (double load : loads) {
      for (uint8_t packets : {uint8_t{1}, uint8_t{2}, uint8_t{4}, uint8_t{8}}) {
        cells.push_back({timing, load, packets});
      }
    }
  }
  return cells;
}
EverybodyConfig crowd(const CrowdCell& cell) {
  EverybodyConfig config;
  config.timing = cell.timing;
  config.load = cell.load;
  config.packets = cell.packets;
  config.periods = 8;
  return config;
}
template <class P>
Counts ideal(const EverybodyConfig& config, const IdealMemory& memory) {
  typename IdealRobot<P>::Settings settings;
  settings.memory = memory;
  return everybody_floods<IdealRobot<P>>(config, 1, settings);
}

class CrowdWithRoom : public ::testing::TestWithParam<CrowdCell> {};

TEST_P(CrowdWithRoom, HearsAllThatUnlimitedMemoryHearsInAsManyTransmissions) {
  const EverybodyConfig config = crowd(GetParam());
  const Counts counts = everybody_floods<CoreRobot<FloodRoom>>(config, 1);
  const Counts best = ideal<FloodRoom>(config, unlimited_memory<FloodRoom>());
  EXPECT_GE(counts.delivered, best.delivered);
  EXPECT_GE(counts.delivered_of_all(), 0.99);
  EXPECT_LE(counts.transmissions_of_ideal(36), 1.05);
  expect_clean(counts);
}
TEST_P(CrowdWithRoom, LosesOnlyWhatItsQueueCannotHold) {
  const EverybodyConfig config = crowd(GetParam());
  const Counts counts = everybody_floods<CoreRobot<RoomForAll>>(config, 1);
  const Counts best = ideal<RoomForAll>(config, unlimited_memory<RoomForAll>());
  // Which packets find the queue full is luck, and of 8 packets each has to find room.
  EXPECT_GE(static_cast<double>(counts.delivered), 0.97 * static_cast<double>(best.delivered));
  EXPECT_LE(counts.transmissions_of_ideal(36), 1.05);
  expect_clean(counts);
}
INSTANTIATE_TEST_SUITE_P(All, CrowdWithRoom, ::testing::ValuesIn(crowd_cells({0.5, 1.0})));

class CrowdWith20Records : public ::testing::TestWithParam<CrowdCell> {};

/// The bound is the best policy with the same memory that is told each message's identity and
/// delivers next to nothing twice. In bursts of 36 messages, to forget the oldest delivers more,
/// and each message up to five times.
TEST_P(CrowdWith20Records, HearsNearlyWhatTheBestPolicyHears) {
  const EverybodyConfig config = crowd(GetParam());
  const Counts counts = everybody_floods<CoreRobot<Kilobot>>(config, 1);
  Counts best;
  for (const IdealMemory& memory : memories_of<Kilobot>()) {
    const Counts its = ideal<Kilobot>(config, memory);
    if (its.duplicates_per_delivery() <= 0.01 && its.delivered > best.delivered) best = its;
  }
  ASSERT_GT(best.delivered, 0u);
  EXPECT_GE(static_cast<double>(counts.delivered), 0.90 * static_cast<double>(best.delivered));
  EXPECT_LE(counts.duplicates_per_delivery(), 0.01);
  EXPECT_EQ(counts.spliced, 0u);
}
INSTANTIATE_TEST_SUITE_P(All, CrowdWith20Records, ::testing::ValuesIn(crowd_cells({0.5})));

/// That the paces above leave room for it, also in a Kilobot's queue.
TEST(IdealRobot, HearsEverythingOverSeveralHops) {
  IdealRobot<Kilobot>::Settings settings;
  settings.memory = unlimited_memory<Kilobot>();
  for (const HopsCell& cell : hops_cells()) {
    const Counts counts = FastFlood<IdealRobot<Kilobot>>(hops(cell, 1), settings).run();
    EXPECT_EQ(counts.delivered, counts.intended) << cell;
    expect_clean(counts);
  }
}

/// What the bounds rest on: a node that is told identities and forgets nothing loses nothing.
TEST(IdealRobot, HearsEverythingOnce) {
  for (const CrowdCell& cell : crowd_cells({1.0})) {
    const Counts counts = ideal<FloodRoom>(crowd(cell), unlimited_memory<FloodRoom>());
    EXPECT_EQ(counts.delivered, counts.intended) << cell;
    EXPECT_EQ(counts.transmissions, counts.packets * 36) << cell;
    expect_clean(counts);
  }
}

class CrowdCondition : public ::testing::TestWithParam<const char*> {};

TEST_P(CrowdCondition, ChangesNothingAtHalfLoad) {
  const std::string condition = GetParam();
  EverybodyConfig config;
  config.timing = Timing::kRandom;
  config.mixed_lengths = true;
  config.periods = 8;
  if (condition == "two channels") config.channels = 2;
  if (condition == "drift") config.drift = 0.02;
  const Counts with_room = everybody_floods<CoreRobot<FloodRoom>>(config, 2);
  EXPECT_GE(with_room.delivered_of_all(), 0.99);
  expect_clean(with_room);
  const Counts kilobot = everybody_floods<CoreRobot<Kilobot>>(config, 2);
  EXPECT_GE(kilobot.delivered_of_all(), 0.95);
  expect_clean(kilobot);
}
INSTANTIATE_TEST_SUITE_P(All, CrowdCondition,
                         ::testing::Values("mixed lengths", "two channels", "drift"));

}  // namespace
}  // namespace swarmtalk::core::testing
