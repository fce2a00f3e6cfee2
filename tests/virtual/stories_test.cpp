// Stories of whole swarms, in virtual time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "loop/clock.hpp"
#include "loop/timer.hpp"
#include "tests/virtual/key_file.hpp"
#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

TEST(VirtualSwarm, CarriesAMessageAsFarAsItsHops) {
  Swarm swarm;
  swarm.air().set_range(1.5);
  for (int n = 1; n <= 4; ++n) swarm.add(n, {1.0 * n, 0}).program("ear").subscribe("alarm");
  swarm.robot(1).program("mouth").send("alarm", "near", 0);
  swarm.robot(1).program("mouth").send("alarm", "far", 1);
  swarm.advance(1s);
  EXPECT_THAT(swarm.robot(1).program("ear").heard(), ElementsAre("near", "far"));
  EXPECT_THAT(swarm.robot(2).program("ear").heard(), ElementsAre("near", "far"));
  EXPECT_THAT(swarm.robot(3).program("ear").heard(), ElementsAre("far"));
  EXPECT_THAT(swarm.robot(4).program("ear").heard(), IsEmpty());
  EXPECT_EQ(swarm.robot(1).program("mouth").sent(), 2);
}

/// A daemon passes on what it hears though its robot runs nothing, and the hearer is told the way.
TEST(VirtualSwarm, PassesMessagesOnOverARobotWithoutPrograms) {
  Swarm swarm;
  swarm.air().set_range(1.5);
  for (int n = 1; n <= 3; ++n) swarm.add(n, {1.0 * n, 0});
  std::vector<std::uint32_t> way;
  const Subscriber ear =
      swarm.robot(3).program("ear").client().subscribe("relay", [&](const Message& message) {
        way.insert(way.end(), {message.sender, message.transmitter, message.hops});
      });
  swarm.robot(1).program("mouth").send("relay", "over the hill", 3);
  swarm.advance(1s);
  EXPECT_THAT(way, ElementsAre(1, 2, 1));
}

/// A program finds the daemon again that was away for a minute, and loses nothing that it sends
/// after.
TEST(VirtualSwarm, GoesOnAfterADaemonHasStartedAgain) {
  Swarm swarm;
  swarm.add(1).program("mouth").send("alarm", "before");
  VirtualProgram& ear = swarm.add(2).program("ear");
  ear.client().on_disconnect({});
  ear.client().on_reconnect({});
  ear.subscribe("alarm");
  swarm.robot(1).program("mouth").send("alarm", "first");
  swarm.advance(1s);
  swarm.robot(2).stop();
  swarm.advance(60s);
  EXPECT_FALSE(ear.client().is_connected());
  swarm.robot(2).start();
  swarm.advance(5s);
  ASSERT_TRUE(ear.client().is_connected());
  swarm.robot(1).program("mouth").send("alarm", "second");
  swarm.advance(1s);
  EXPECT_THAT(ear.heard(), ElementsAre("first", "second"));
}

/// Wherever the streams between programs and daemons are cut, what arrives is what was sent.
TEST(VirtualSwarm, TakesStreamsInPiecesOfAnySize) {
  for (const std::size_t longest : {1u, 2u, 7u, 50u}) {
    Swarm swarm(longest);
    swarm.cut_streams(longest);
    swarm.add(2).program("ear").subscribe("c", Policy::last(64));
    VirtualProgram& mouth = swarm.add(1).program("mouth");
    std::vector<std::string> said;
    for (int i = 0; i < 40; ++i) {
      said.push_back(std::to_string(i) + std::string(static_cast<std::size_t>(i * i), 'x'));
      mouth.send("c", said.back());
      swarm.advance(10ms);
    }
    swarm.advance(1s);
    EXPECT_EQ(swarm.robot(2).program("ear").heard(), said) << longest;
    EXPECT_EQ(mouth.sent(), 40) << longest;
  }
}

/// What ten robots hear on an air that loses a third, each with beacons, messages over two hops, a
/// restart; sealed, so that nonces are drawn too. @return with the course of all frames and logs
std::pair<std::vector<std::string>, std::uint64_t> course_of(std::uint64_t seed) {
  const KeyFile key;
  Swarm swarm(seed);
  swarm.air().set_range(2.5);
  swarm.air().set_loss(1.0 / 3);
  for (int n = 1; n <= 10; ++n) {
    swarm.add(n, {1.0 * n, 0}, "beacon_ms = 500\nkey_file = \"" + key.path() + "\"\n");
    swarm.robot(n).program("p").subscribe("c");
    swarm.robot(n).program("p").client().on_disconnect({});
    swarm.robot(n).program("p").client().on_reconnect({});
  }
  for (int second = 0; second < 20; ++second) {
    if (second == 7) swarm.robot(4).stop();
    if (second == 11) swarm.robot(4).start();
    for (int n = 1; n <= 10; ++n) {
      if (n == 4) continue;
      swarm.robot(n).program("p").send("c", std::to_string(n) + "." + std::to_string(second), 2);
    }
    swarm.advance(1s);
  }
  std::vector<std::string> heard;
  for (int n = 1; n <= 10; ++n) {
    const auto& part = swarm.robot(n).program("p").heard();
    heard.insert(heard.end(), part.begin(), part.end());
  }
  return {heard, swarm.course()};
}

TEST(VirtualSwarm, TakesTheSameCourseWithTheSameSeed) {
  const auto first = course_of(7);
  EXPECT_GT(first.first.size(), 800u);
  EXPECT_EQ(first, course_of(7));
  EXPECT_NE(first, course_of(8));
}

/// A hundred robots on a grid, ten neighbours each (12 inside, fewer at the edge), a message a
/// second: each is heard by every neighbour once, and not by its own program.
/// SWARMTALK_VIRTUAL_SECONDS: for so long, for its cost.
TEST(VirtualSwarm, CarriesTheMessagesOfAHundred) {
  constexpr int kSide = 10;
  constexpr int kNeighbours = 1004;  // of all robots, on such a grid
  const char* const asked = std::getenv("SWARMTALK_VIRTUAL_SECONDS");
  const int seconds = asked == nullptr ? 5 : std::atoi(asked);
  Swarm swarm;
  swarm.air().set_range(2.0);
  for (int n = 1; n <= kSide * kSide; ++n) {
    swarm.add(n, {1.0 * (n % kSide), 1.0 * ((n - 1) / kSide)}, "beacon_ms = 1000\n");
    swarm.robot(n).program("p").subscribe("c", Policy::last(64));
  }
  for (int second = 0; second < seconds; ++second) {
    for (int n = 1; n <= kSide * kSide; ++n) {
      swarm.robot(n).program("p").send("c", "message of twenty B.", 0);
    }
    swarm.advance(1s);
  }
  std::size_t heard = 0;
  for (int n = 1; n <= kSide * kSide; ++n) heard += swarm.robot(n).program("p").heard().size();
  EXPECT_EQ(heard, static_cast<std::size_t>(seconds) * kNeighbours);
}

/// What does not arrive is told, and the accounts add up: one sender, one hearer, one frame of two
/// lost; the last one's fate is known by the beacon after it.
/// What came to its socket meanwhile is heard with the time of its coming. With a key as well: what
/// is judged is how long a frame was on its way there.
TEST(VirtualSwarm, HearsWhatCameWhileADaemonStoodStill) {
  const KeyFile key;
  for (const std::string& keys : {std::string(), "key_file = \"" + key.path() + "\"\n"}) {
    Swarm swarm;
    for (int n = 1; n <= 2; ++n) swarm.add(n, {}, "beacon_ms = 500\n" + keys);
    VirtualProgram& mouth = swarm.robot(1).program("mouth");
    std::vector<std::string> heard;
    const Subscriber ear =
        swarm.robot(2).program("ear").client().subscribe("c", [&](const Message& message) {
          const auto ago = loop::now() - message.received_at.value_or(loop::Timer::Time{});
          heard.push_back(std::string(message.text()) + " " + std::to_string(ago / 1s) + " s ago");
        });
    swarm.advance(2s);
    swarm.robot(2).set_running(false);
    mouth.send("c", "first");
    swarm.advance(7s);
    mouth.send("c", "second");
    swarm.advance(2s);
    EXPECT_THAT(heard, IsEmpty());
    swarm.robot(2).set_running(true);
    swarm.advance(1s);
    EXPECT_THAT(heard, ElementsAre("first 9 s ago", "second 2 s ago"));
    EXPECT_EQ(swarm.robot(2).counter("frames_too_old"), 0u);
  }
}

/// A robot that has nothing to do sleeps: what it says by itself is all that wakes it.
TEST(VirtualSwarm, WakesARobotForNothingButItsBeacons) {
  Swarm swarm;
  swarm.add(1).program("ear").subscribe("c");
  swarm.add(2, {}, "beacon_ms = 1000\n").program("ear").subscribe("c");
  swarm.advance(1min);
  std::uint64_t before[2];
  for (int n = 1; n <= 2; ++n) before[n - 1] = swarm.robot(n).wakeups();
  const std::uint64_t frames = swarm.air().frames_of(2).sent;
  swarm.advance(1h);
  EXPECT_EQ(swarm.robot(1).wakeups() - before[0], 0u);
  const std::uint64_t beacons = swarm.air().frames_of(2).sent - frames;
  EXPECT_EQ(swarm.robot(2).wakeups() - before[1], beacons);
  EXPECT_GE(beacons, 3600u);
}

TEST(VirtualSwarm, TellsEachLossOnTheAir) {
  Swarm swarm(3);
  swarm.air().set_loss(0.5);
  VirtualProgram& mouth = swarm.add(1, {}, "beacon_ms = 200\n").program("mouth");
  VirtualProgram& ear = swarm.add(2).program("ear");
  ear.subscribe("c");
  mouth.send("c", "0");
  swarm.advance(2s);  // until the hearer knows the channel's count
  for (int i = 1; i <= 100; ++i) {
    mouth.send("c", std::to_string(i));
    swarm.advance(100ms);
  }
  swarm.air().set_loss(0);
  mouth.send("c", "end");
  swarm.advance(1s);
  int heard = 0;
  int lost = 0;
  for (const std::string& each : ear.heard()) {
    if (each.starts_with("lost ")) {
      lost += std::stoi(each.substr(5));
    } else {
      ++heard;
    }
  }
  EXPECT_EQ(heard + lost, 101 + (ear.heard().front() == "0" ? 1 : 0));
  EXPECT_GT(lost, 30);
}

}  // namespace
}  // namespace swarmtalk::test
