// Redundancy between whole robots, on an air that loses a fifth of all frames. Each bound is five
// standard deviations from what the loss makes likely, so that it holds with any seed.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <string>

#include "tests/virtual/swarm.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;

constexpr int kMessages = 1000;
constexpr double kLoss = 0.2;
constexpr int kPacketBytes = 1383;  // a packet's share of a message: each fills a frame

void expect_share(double heard, double of, double share) {
  EXPECT_NEAR(heard, of * share, 5 * std::sqrt(of * share * (1 - share)));
}

class VirtualRedundancy : public testing::Test {
 protected:
  VirtualRedundancy() {
    for (int n = 1; n <= 3; ++n) swarm_.add(n, {}, "air_rate_mbps = 6.0\n");
    for (int n = 2; n <= 3; ++n) {
      swarm_.robot(n).program("ear").client().on_error({});
      swarm_.robot(n).program("ear").subscribe("c", Policy::last(kMessages));
    }
    swarm_.air().set_loss(kLoss);
  }

  /// Publishes, a message each `interval`, and waits for what comes late.
  void publish(const std::string& payload, const Sending& sending,
               std::chrono::milliseconds interval) {
    VirtualProgram& mouth = swarm_.robot(1).program("mouth");
    mouth.advertise("c", sending);
    for (int i = 0; i < kMessages; ++i) {
      mouth.send("c", std::to_string(i) + payload);
      swarm_.advance(interval);
    }
    swarm_.advance(2s);
    EXPECT_EQ(mouth.sent(), kMessages);
  }
  /// Of the messages, by both hearers; none twice or damaged.
  double heard(const std::string& payload) {
    int count = 0;
    for (int n = 2; n <= 3; ++n) {
      int last = -1;
      for (const std::string& each : swarm_.robot(n).program("ear").heard()) {
        if (each.starts_with("lost ")) continue;
        const int number = std::stoi(each);
        EXPECT_EQ(each, std::to_string(number) + payload);
        EXPECT_GT(number, last);
        last = number;
        ++count;
      }
    }
    return count;
  }

  Swarm swarm_{1};
};

/// Not a digit first: it follows a number.
const std::string kFourPackets(4 * kPacketBytes - 10, 'x');
const std::string kOnePacket(24, 'x');

TEST_F(VirtualRedundancy, IsMissedByMessagesOfFourPackets) {
  publish(kFourPackets, {}, 25ms);
  EXPECT_EQ(swarm_.robot(1).counter("packets_sent"), 4u * kMessages);
  expect_share(heard(kFourPackets), 2.0 * kMessages, std::pow(1 - kLoss, 4));
}

TEST_F(VirtualRedundancy, BringsMessagesOfFourPacketsWhereAnyFourOfSevenArrive) {
  publish(kFourPackets, Sending().redundant(3), 25ms);
  EXPECT_EQ(swarm_.robot(1).counter("packets_sent"), 7u * kMessages);
  EXPECT_EQ(swarm_.robot(1).counter("repairs_sent"), 3u * kMessages);
  expect_share(heard(kFourPackets), 2.0 * kMessages, 0.9667);
  EXPECT_GT(swarm_.robot(2).counter("packets_recovered"), 400u);
  EXPECT_EQ(swarm_.robot(2).counter("node_bad_packets"), 0u);
}

TEST_F(VirtualRedundancy, LetsOnePacketRideInAFrameThatLeavesAnyway) {
  publish(kOnePacket, Sending().redundant(1), 10ms);
  EXPECT_EQ(swarm_.robot(1).counter("repairs_sent"), 1u * kMessages);
  EXPECT_EQ(swarm_.robot(1).counter("frames_sent"), 1u * kMessages + 1)
      << "the last copy alone leaves by itself";
  expect_share(heard(kOnePacket), 2.0 * kMessages, 1 - kLoss * kLoss);
}

TEST_F(VirtualRedundancy, IsMissedByMessagesOfOnePacket) {
  publish(kOnePacket, {}, 10ms);
  EXPECT_EQ(swarm_.robot(1).counter("frames_sent"), 1u * kMessages);
  expect_share(heard(kOnePacket), 2.0 * kMessages, 1 - kLoss);
}

/// As many repair packets as the loss demands that is measured around the robot: none where nothing
/// is lost, some once it is.
TEST(VirtualAutoRedundancy, FollowsTheLossThatIsMeasured) {
  Swarm swarm;
  for (int n = 1; n <= 2; ++n) swarm.add(n, {}, "beacon_ms = 20\n");
  VirtualProgram& mouth = swarm.robot(1).program("mouth");
  mouth.advertise("c", Sending().redundant());
  swarm.advance(5s);
  const auto repairs_of_ten = [&] {
    const std::uint64_t before = swarm.robot(1).counter("repairs_sent");
    for (int i = 0; i < 10; ++i) {
      mouth.send("c", kFourPackets);
      swarm.advance(25ms);
    }
    return swarm.robot(1).counter("repairs_sent") - before;
  };
  EXPECT_EQ(repairs_of_ten(), 0u);
  swarm.air().set_loss(0.3);
  swarm.advance(10s);
  EXPECT_GE(repairs_of_ten(), 10u);
}

}  // namespace
}  // namespace swarmtalk::test
