// The wall clock of all robots is set, back and forth, while messages cross the air: nothing
// changes for daemons that run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/turned_clock.hpp"
#include "tests/virtual/key_file.hpp"
#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;

constexpr std::optional<std::chrono::microseconds> kNotKnown;

/// Two messages at once, each of a frame, on a link of 100 frames a second: the second waits 10 ms.
/// Of the first after a step of the clock nobody knows when it came: the kernel's stamp is of the
/// clock before.
void hears_all_with_their_delays(const std::string& keys) {
  Swarm swarm;
  for (int n = 1; n <= 2; ++n) swarm.add(n, {}, "rate_hz = 100\n" + keys);
  ChannelOptions options;
  options.timestamped = true;
  std::vector<std::string> heard;
  std::vector<std::optional<std::chrono::microseconds>> delays;
  Client& ear = swarm.robot(2).program("ear").client();
  const Subscriber subscriber = ear.channel("c", options).subscriber([&](const Message& message) {
    heard.emplace_back(message.text());
    delays.push_back(message.buffering_delay);
  });
  Publisher publisher = swarm.robot(1).program("mouth").client().channel("c", options).publisher();
  std::vector<std::string> said;
  std::vector<std::optional<std::chrono::microseconds>> expected;
  const std::vector<std::chrono::nanoseconds> steps{1h, -1h, 500ms, -500ms, 3s, 0s, -24h, 0s};
  swarm.advance(1s);
  for (std::size_t round = 0; round <= steps.size(); ++round) {
    // The first round is without a step: the daemon reads its clocks.
    if (round > 0) step_wall_clock(steps[round - 1]);
    for (const char* part : {".1", ".2"}) {
      said.push_back(std::to_string(round) + part + std::string(1000, 'x'));
      EXPECT_TRUE(publisher.send(said.back()));
    }
    const bool is_set = round > 0 && steps[round - 1] != 0s;
    expected.push_back(is_set ? kNotKnown : 0us);
    expected.emplace_back(10ms);
    swarm.advance(500ms);
  }
  EXPECT_EQ(heard, said);
  EXPECT_EQ(delays, expected);
  EXPECT_EQ(swarm.robot(2).parts().counters().messages_lost_air, 0u);
  EXPECT_EQ(swarm.warnings(), 0);
}

TEST(VirtualWallClock, ChangesNeitherDeliveryNorDelaysWhenItIsSet) {
  hears_all_with_their_delays("");
}

/// The age of these is judged.
TEST(VirtualWallClock, ChangesNothingForSealedFramesEither) {
  const KeyFile key;
  hears_all_with_their_delays("key_file = \"" + key.path() + "\"\n");
}

/// Two robots, a day apart: each line of the log is of the robot whose daemon writes it, and has
/// that one's time, also where the test and not the daemon's own loop is the cause.
TEST(VirtualWallClock, IsThatOfTheRobotWhoseLineItIs) {
  testing::internal::CaptureStderr();
  {
    Swarm swarm;
    swarm.add(1);
    swarm.add(2).step_wall_clock(24h);
    swarm.advance(1s);
    ipc::Reloaded reply;
    EXPECT_FALSE(swarm.robot(1).parts().operations().reload("a test", reply));
    EXPECT_FALSE(swarm.robot(2).parts().operations().reload("a test", reply));
    swarm.air().set_link(1, false);
    swarm.air().set_link(2, false);
    swarm.robot(2).stop();
    swarm.robot(1).stop();
  }
  std::istringstream log(testing::internal::GetCapturedStderr());
  std::vector<std::string> lines;
  for (std::string line; std::getline(log, line);) {
    const bool is_of_cause =
        line.find("a test") != std::string::npos || line.find("switched off") != std::string::npos;
    if (is_of_cause) lines.push_back(line.substr(0, std::string("robot 1 2026-01-01").size()));
  }
  EXPECT_THAT(lines, testing::ElementsAre("robot 1 2026-01-01", "robot 2 2026-01-02",
                                          "robot 1 2026-01-01", "robot 2 2026-01-02"));
}

}  // namespace
}  // namespace swarmtalk::test
