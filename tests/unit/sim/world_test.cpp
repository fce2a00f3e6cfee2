// The world's radio, clocks, bodies and faults, with nodes that send all the time.
#include "sim/world.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <vector>

#include "platforms/sim/world_robot.hpp"

namespace swarmtalk::sim {
namespace {

using Profile = platforms::ComparedProfile;
using TestWorld = World<Profile>;

/// Every robot sends one-packet messages without end and counts what it hears.
struct Chatter {
  explicit Chatter(const WorldConfig& config, uint64_t seed = 1) : world(config, seed) {}

  void add(double x_mm, double y_mm = 0) {
    world.add(x_mm, y_mm);
    heard.push_back(0);
    distance.push_back(-1);
    restarts.push_back(0);
  }
  void start() {
    world.start({this, &loop, &restart});
    for (uint32_t i = 0; i < world.size(); ++i) set_up(i);
  }
  void set_up(uint32_t robot) {
    auto* channel = world.node(robot).new_channel(0, 0, false);
    auto* publisher = channel->new_publisher(nullptr, nullptr);
    if (publishers.size() <= robot) publishers.resize(robot + 1);
    publishers[robot] = publisher;
    listeners.push_back({this, robot});
    channel->new_subscriber(32000, &receive, &listeners.back());
  }
  static void loop(void* self, uint32_t robot) {
    Chatter& me = *static_cast<Chatter*>(self);
    const uint8_t byte = 1;
    me.publishers[robot]->send(&byte, 1);
    ++me.loops;
  }
  static void restart(void* self, uint32_t robot) {
    Chatter& me = *static_cast<Chatter*>(self);
    ++me.restarts[robot];
    me.set_up(robot);
  }
  static void receive(void* self, const uint8_t*, uint16_t,
                      const core::Reception<Profile>& reception) {
    Listener& listener = *static_cast<Listener*>(self);
    ++listener.chatter->heard[listener.robot];
    listener.chatter->distance[listener.robot] = reception.sensing.distance;
  }
  /// Every packet on the air has one fate, except those that are on their way.
  void expect_balance() {
    const AirCounters& air = world.air();
    EXPECT_EQ(air.expected, air.received + air.lost_collision + air.lost_while_sending +
                                air.lost_noise + air.lost_jam + air.lost_partition +
                                air.lost_death);
  }

  struct Listener {
    Chatter* chatter;
    uint32_t robot;
  };
  TestWorld world;
  std::vector<core::Publisher<Profile>*> publishers;
  std::deque<Listener> listeners;
  std::vector<uint32_t> heard;
  std::vector<int> distance;
  std::vector<int> restarts;
  uint64_t loops = 0;
};

WorldConfig quiet() {
  WorldConfig config;
  config.radio.distance_noise_mm = 0;
  config.clock = {0, 0};
  return config;
}

TEST(World, RunsWithoutHooks) {
  TestWorld world(WorldConfig{}, 1);
  world.add(0, 0);
  world.start({});
  world.run_until(1000000);
  EXPECT_EQ(world.now_us(), 1000000u);
  EXPECT_GT(world.ticks(0), 0u);
}

TEST(World, CarriesPacketsAsFarAsTheRangeWithTheDistance) {
  Chatter swarm(quiet());
  swarm.add(0);
  swarm.add(60);
  swarm.add(120);  // hears the middle one only
  swarm.start();
  swarm.world.run_until(30'000'000);
  EXPECT_EQ(swarm.distance[0], 60);
  EXPECT_EQ(swarm.distance[2], 60);
  EXPECT_EQ(swarm.world.listeners(1), (std::vector<uint32_t>{0, 2}));
  EXPECT_EQ(swarm.world.listeners(2), (std::vector<uint32_t>{1}));
  EXPECT_GT(swarm.heard[0], 45u);  // 57 turns
  swarm.expect_balance();
}

TEST(World, CollidesHiddenSendersAndNotThoseThatHearEachOther) {
  WorldConfig config = quiet();
  config.radio.period_us = 20000;  // air is taken half of the time
  Chatter hidden(config), heard(config);
  for (const double x : {0.0, 70.0, 140.0}) hidden.add(x);
  for (const double x : {0.0, 10.0, 20.0}) heard.add(x);
  hidden.start();
  heard.start();
  hidden.world.run_until(20'000'000);
  heard.world.run_until(20'000'000);
  const double lost_hidden = static_cast<double>(hidden.world.air().lost_collision) /
                             static_cast<double>(hidden.world.air().expected);
  const double lost_heard = static_cast<double>(heard.world.air().lost_collision) /
                            static_cast<double>(heard.world.air().expected);
  EXPECT_GT(lost_hidden, 0.1);
  EXPECT_LT(lost_heard, 0.06);
  EXPECT_GT(heard.world.air().deferred, 100u);
  hidden.expect_balance();
  heard.expect_balance();
}

TEST(World, LosesTheShareThatIsAskedFor) {
  WorldConfig config = quiet();
  config.radio.loss = 0.2;
  Chatter swarm(config);
  swarm.add(0);
  swarm.add(50);
  swarm.start();
  swarm.world.run_until(1000'000'000);
  const AirCounters& air = swarm.world.air();
  EXPECT_NEAR(static_cast<double>(air.lost_noise) / static_cast<double>(air.expected), 0.2, 0.02);
  swarm.expect_balance();
}

TEST(World, HasLinksOfOneWayOnlyWhenAsymmetric) {
  WorldConfig config = quiet();
  config.radio.asymmetry = 0.3;
  Chatter swarm(config);
  for (int i = 0; i < 20; ++i) swarm.add(i * 300.0), swarm.add(i * 300.0 + 75);
  int one_way = 0;
  for (uint32_t i = 0; i < 40; i += 2) {
    one_way += swarm.world.listeners(i).size() != swarm.world.listeners(i + 1).size();
  }
  EXPECT_GT(one_way, 4);
  EXPECT_LT(one_way, 16);
}

TEST(World, LetsClocksDriftWithinTheLimitAndApart) {
  WorldConfig config = quiet();
  config.clock = {10000, 250000};
  Chatter swarm(config);
  for (int i = 0; i < 50; ++i) swarm.add(i * 50.0);
  swarm.start();
  swarm.world.run_until(100'000'000);
  uint32_t least = UINT32_MAX, most = 0;
  for (uint32_t i = 0; i < 50; ++i) {
    least = std::min(least, swarm.world.ticks(i));
    most = std::max(most, swarm.world.ticks(i));
  }
  EXPECT_GE(least, 3013u);  // (100 - 0.25) s * 0.99 / 32.768 ms
  EXPECT_LE(most, 3083u);
  EXPECT_GT(most - least, 20u);
}

TEST(World, RunsTheLoopOncePerTick) {
  Chatter swarm(quiet());
  swarm.add(0);
  swarm.start();
  swarm.world.run_until(32768 * 100);
  EXPECT_EQ(swarm.loops, 101u);
}

TEST(World, FaultsSilenceRestartPartitionJamAndStepClocks) {
  WorldConfig config = quiet();
  Fault death, restart, partition, jam, step;
  death.at_us = 10'000'000;
  restart.kind = Fault::Kind::kRestart;
  restart.at_us = 20'000'000;
  partition.kind = Fault::Kind::kPartition;
  partition.at_us = 30'000'000;
  partition.end_us = 40'000'000;
  partition.x_mm = 25;
  jam.kind = Fault::Kind::kJam;
  jam.at_us = 50'000'000;
  jam.end_us = 60'000'000;
  jam.radius_mm = 10;
  step.kind = Fault::Kind::kClockStep;
  step.at_us = 70'000'000;
  step.robot = 1;
  step.ticks = -1000;
  config.faults = {death, restart, partition, jam, step};
  Chatter swarm(config);
  swarm.add(0);
  swarm.add(50);
  swarm.start();
  std::vector<uint32_t> heard0, heard1;
  for (uint64_t s = 10; s <= 70; s += 10) {
    swarm.world.run_until(s * 1'000'000 - 1);
    heard0.push_back(swarm.heard[0]);
    heard1.push_back(swarm.heard[1]);
  }
  EXPECT_EQ(heard1[1], heard1[0]);  // robot 0 is dead
  EXPECT_EQ(swarm.restarts[0], 1);
  EXPECT_GT(heard1[2], heard1[1] + 10);
  EXPECT_LE(heard1[3], heard1[2] + 1);   // partition; one packet may have been on its way
  EXPECT_LE(heard0[5], heard0[4] + 0);   // robot 0 is jammed
  EXPECT_GT(heard1[5], heard1[4] + 10);  // robot 1 is not
  EXPECT_GT(swarm.world.air().lost_partition, 20u);
  EXPECT_GT(swarm.world.air().lost_jam, 10u);
  swarm.world.run_until(70'000'001);
  EXPECT_EQ(swarm.world.ticks(1), 70'000'001 / kTickUs - 1000);
  swarm.expect_balance();
}

TEST(World, StopsABodyAtAnother) {
  WorldConfig config = quiet();
  config.body.speed_bias = config.body.motion_noise = 0;  // or it slides past in time
  Chatter swarm(config);
  swarm.add(0);
  swarm.add(60);
  swarm.start();
  swarm.world.body(0).drive(1, 1);
  swarm.world.run_until(20'000'000);
  EXPECT_NEAR(swarm.world.body(0).x_mm, 60 - 33, 1e-6);
  EXPECT_GT(swarm.world.contacts(0), 10u);
  EXPECT_EQ(swarm.world.contacts(1), 0u);
}

}  // namespace
}  // namespace swarmtalk::sim
