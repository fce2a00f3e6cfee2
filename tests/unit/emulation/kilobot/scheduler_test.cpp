#include "emulation/kilobot/scheduler.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::emulator {
namespace {

struct Recorder : Steppable {
  std::vector<std::pair<int, std::uint64_t>>& calls;
  int number;
  Recorder(std::vector<std::pair<int, std::uint64_t>>& to, int node) : calls(to), number(node) {}
  void run_until(std::uint64_t time_ns) override { calls.emplace_back(number, time_ns); }
};

TEST(Scheduler, RunsNodesInLockstepAndInOrder) {
  std::vector<std::pair<int, std::uint64_t>> calls;
  Recorder first(calls, 1), second(calls, 2);
  Scheduler scheduler(100);
  scheduler.add(first);
  scheduler.add(second);
  scheduler.run_until(250);
  const std::vector<std::pair<int, std::uint64_t>> expected{{1, 100}, {2, 100}, {1, 200},
                                                            {2, 200}, {1, 250}, {2, 250}};
  EXPECT_EQ(calls, expected);
}

TEST(Scheduler, CallsTasksAtTheirPeriods) {
  Scheduler scheduler(100);
  std::vector<std::uint64_t> times;
  scheduler.every(250, [&](std::uint64_t time_ns) { times.push_back(time_ns); });
  scheduler.run_until(1000);
  EXPECT_EQ(times, (std::vector<std::uint64_t>{0, 250, 500, 750}));
}

TEST(Scheduler, GoesOnWhereItHasStopped) {
  std::vector<std::pair<int, std::uint64_t>> calls;
  Recorder node(calls, 1);
  Scheduler scheduler(100);
  scheduler.add(node);
  scheduler.run_until(100);
  scheduler.run_until(200);
  EXPECT_EQ(calls.size(), 2u);
  EXPECT_EQ(scheduler.now_ns(), 200u);
}

TEST(Scheduler, StopsWhenATaskSaysSo) {
  Scheduler scheduler(100);
  scheduler.every(1000, [&](std::uint64_t time_ns) {
    if (time_ns == 2000) scheduler.stop();
  });
  scheduler.run_until(1'000'000);
  EXPECT_EQ(scheduler.now_ns(), 2100u);
}

TEST(Scheduler, KeepsItsDistanceToTheWallClock) {
  std::uint64_t wall_ns = 5'000'000;
  std::vector<std::uint64_t> waits;
  Scheduler::WallClock clock{[&] { return wall_ns; },
                             [&](std::uint64_t time_ns) {
                               waits.push_back(time_ns);
                               wall_ns = time_ns;
                             }};
  Scheduler scheduler(1'000'000);
  scheduler.pace(0.5, clock);  // half as fast as the wall clock
  scheduler.run_until(10'000'000);
  EXPECT_EQ(wall_ns, 5'000'000u + 20'000'000u);
  EXPECT_EQ(waits.size(), 10u);
}

TEST(Scheduler, DoesNotWaitWhenItIsBehind) {
  std::uint64_t wall_ns = 0;
  bool has_waited = false;
  Scheduler::WallClock clock{[&] { return wall_ns += 10'000'000; },
                             [&](std::uint64_t) { has_waited = true; }};
  Scheduler scheduler(1'000'000);
  scheduler.pace(1, clock);
  scheduler.run_until(20'000'000);
  EXPECT_FALSE(has_waited);
}

}  // namespace
}  // namespace swarmtalk::emulator
