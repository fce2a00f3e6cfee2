// Redundancy between whole robots, on an air that loses a fifth of all frames. Each bound is five
// standard deviations from what the loss makes likely, so that it holds with any seed.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

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
  for (int n = 2; n <= 3; ++n) {
    EXPECT_GT(swarm_.robot(n).counter("packets_recovered"), 400u) << n;
    EXPECT_EQ(swarm_.robot(n).counter("node_bad_packets"), 0u) << n;
  }
}

TEST_F(VirtualRedundancy, BringsStillMoreWithCopiesBesides) {
  publish(kFourPackets, Sending().redundant(3).repeated(2), 50ms);
  EXPECT_EQ(swarm_.robot(1).counter("packets_sent"), 11u * kMessages)
      << "copies are of the message, and not of its repair packets";
  expect_share(heard(kFourPackets), 2.0 * kMessages, 0.9978);
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

/// Airtime of messages of one packet, each with so many repair packets.
std::uint64_t airtime_us(std::uint32_t repairs) {
  Swarm swarm;
  VirtualProgram& mouth = swarm.add(1, {}, "air_rate_mbps = 6.0\n").program("mouth");
  mouth.advertise("c", Sending().redundant(repairs));
  for (int i = 0; i < kMessages; ++i) {
    mouth.send("c", kOnePacket);
    swarm.advance(10ms);
  }
  swarm.advance(2s);
  return swarm.robot(1).counter("airtime_us_sent");
}

TEST(VirtualRedundancyOfOnePacket, CostsLessThanAThirdMoreAir) {
  const std::uint64_t plain = airtime_us(0);
  EXPECT_GT(plain, 0u);
  EXPECT_LE(airtime_us(1), plain + plain * 3 / 10);
}

TEST(VirtualRedundancyOnASmallProfile, IsNoneAndTheMessageLeavesWithout) {
  Swarm swarm;
  for (int n = 1; n <= 2; ++n) {
    swarm.add(n, {}, "profile = \"footbot\"\n[channels]\nc = 3\n");
  }
  VirtualProgram& ear = swarm.robot(2).program("ear");
  ear.subscribe("c");
  Client& client = swarm.robot(1).program("mouth").client();
  Publisher publisher = client.advertise("c", Sending().redundant(2));
  EXPECT_TRUE(publisher.send("x"));
  swarm.advance(1s);
  EXPECT_FALSE(publisher.has_redundancy());
  EXPECT_EQ(ear.heard(), std::vector<std::string>{"x"});
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
