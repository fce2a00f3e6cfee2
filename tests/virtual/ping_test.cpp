// Daemons that report answer questions on the channel "ping", over hops and on an air that loses
// some. The test asks as `swarmtalk-cli ping` does (docs/wire-format.md, Ping); what that prints is
// in tests/unit/cli.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr int kTtl = 15;
const std::string kReports = "[reserved]\nreport = true\n";

/// A program that asks, as run 7.
class Asker {
 public:
  explicit Asker(VirtualRobot& robot)
      : program_(robot.program("asker")),
        subscriber_(program_.client().subscribe(
            "ping", Policy::last(64), [this](const Message& message) { hear(message); })) {
    program_.advertise("ping", Sending::newest(16));
  }

  void ask(int robot) {
    program_.send("ping",
                  "ping 7 " + std::to_string(++sequence_) + " " + std::to_string(robot) + " " +
                      std::to_string(kTtl),
                  kTtl);
  }
  /// "ROBOT: pong 7 SEQUENCE HEARD HOPS VIA back HOPS"
  const std::vector<std::string>& answers() const { return answers_; }

 private:
  void hear(const Message& message) {
    if (message.local) return;
    answers_.push_back(std::to_string(message.sender) + ": " + std::string(message.text()) +
                       " back " + std::to_string(message.hops));
  }

  VirtualProgram& program_;
  int sequence_ = 0;
  std::vector<std::string> answers_;
  Subscriber subscriber_;
};

/// No program runs on the others. Each robot of the row answers with the hops that the question had
/// behind it and the robot that it came from, which is whom the asker asks next.
TEST(VirtualPing, IsAnsweredByEachRobotOfARowWithTheWayThere) {
  Swarm swarm;
  swarm.air().set_range(1.5);
  for (int n = 1; n <= 4; ++n) swarm.add(n, {1.0 * n, 0}, kReports);
  Asker asker(swarm.robot(1));
  for (const int robot : {4, 3, 2, 4, 3, 2}) {
    asker.ask(robot);
    swarm.advance(1s);
  }
  EXPECT_THAT(asker.answers(), ElementsAre("4: pong 7 1 1 2 3 back 2", "3: pong 7 2 1 1 2 back 1",
                                           "2: pong 7 3 1 0 1 back 0", "4: pong 7 4 2 2 3 back 2",
                                           "3: pong 7 5 2 1 2 back 1", "2: pong 7 6 2 0 1 back 0"));
  for (int n = 1; n <= 4; ++n) {
    const daemon::DaemonCounters& counters = swarm.robot(n).parts().counters();
    EXPECT_EQ(counters.pings_answered, n == 1 ? 0u : 2u) << n;
    EXPECT_EQ(counters.pings_unanswered, 0u) << n;
  }
}

/// An answer says how many questions were heard there, so the asker knows on which way the others
/// were lost: of ten here 2 on the way there and 3 on the way back. The answers wait for a moment
/// of chance (`jitter_us`) before they leave.
TEST(VirtualPing, TellsWhetherQuestionsOrAnswersWereLost) {
  Swarm swarm;
  swarm.add(1);
  swarm.add(2, {}, "jitter_us = 50000\n" + kReports);
  Asker asker(swarm.robot(1));
  for (int question = 1; question <= 10; ++question) {
    const bool is_lost_there = question == 3 || question == 4;
    const bool is_lost_back = question >= 6 && question <= 8;
    swarm.air().set_loss(is_lost_there ? 1 : 0);
    asker.ask(2);
    swarm.advance(0s);
    swarm.air().set_loss(is_lost_back ? 1 : 0);
    swarm.advance(1s);
  }
  EXPECT_THAT(asker.answers(), ElementsAre("2: pong 7 1 1 0 1 back 0", "2: pong 7 2 2 0 1 back 0",
                                           "2: pong 7 5 3 0 1 back 0", "2: pong 7 9 7 0 1 back 0",
                                           "2: pong 7 10 8 0 1 back 0"));
  EXPECT_EQ(swarm.robot(2).parts().counters().pings_answered, 8u);
}

TEST(VirtualPing, IsNotAnsweredByARobotThatDoesNotReport) {
  Swarm swarm;
  swarm.add(1);
  swarm.add(2);
  swarm.add(3, {}, kReports);
  Asker asker(swarm.robot(1));
  asker.ask(2);
  swarm.advance(10s);
  EXPECT_THAT(asker.answers(), IsEmpty());
}

}  // namespace
}  // namespace swarmtalk::test
