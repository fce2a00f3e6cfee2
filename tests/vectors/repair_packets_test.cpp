// Parity packets as receivers meet that know nothing of them: core's node alone. Each is counted as
// a bad packet and neither delivered nor sent on, and it harms nothing. The same packets against
// who makes them and who uses them.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "swarmtalk/profiles/wifi.hpp"
#include "tests/unit/core/test_node.hpp"
#ifndef SWARMTALK_NODE_ALONE  // by hand: against the core of a release that has no such folder
#include "redundancy/recoverer.hpp"
#include "redundancy/repair_sender.hpp"
#include "redundancy/wifi_packet.hpp"
#endif

namespace swarmtalk::core::testing {
namespace {

struct Vector {
  std::string name;
  uint32_t node = 0, epoch = 0, channel = 0, number = 0, ttl = 0, timed = 0, size = 0, parities = 0;
  std::vector<Bytes> packets, parity;

  Bytes message() const {
    Bytes bytes(size);
    for (uint32_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(7 * i + 13 * (i / 256));
    return bytes;
  }
};

std::vector<Vector> read_vectors() {
  std::vector<Vector> vectors;
  std::ifstream file(SWARMTALK_VECTORS "/repair_packets.txt");
  for (std::string text; std::getline(file, text);) {
    std::istringstream line(text);
    std::string word;
    line >> word;
    if (word == "message") {
      Vector& vector = vectors.emplace_back();
      line >> vector.name;
      for (uint32_t* value : {&vector.node, &vector.epoch, &vector.channel, &vector.number,
                              &vector.ttl, &vector.timed, &vector.size, &vector.parities}) {
        line >> word >> *value;
      }
    } else if (word == "packet" || word == "parity") {
      const bool is_parity = word == "parity";
      line >> word;
      Bytes bytes;
      for (std::size_t i = 0; i + 1 < word.size(); i += 2) {
        bytes.push_back(static_cast<uint8_t>(std::stoul(word.substr(i, 2), nullptr, 16)));
      }
      (is_parity ? vectors.back().parity : vectors.back().packets).push_back(bytes);
    }
  }
  return vectors;
}

class RepairPackets : public ::testing::Test {
 protected:
  const std::vector<Vector> vectors_ = read_vectors();
};

/// A node as each robot has it that knows nothing of parity packets.
struct OldRobot : TestNode<Wifi> {
  explicit OldRobot(const Vector& vector) : TestNode<Wifi>(9) {
    node.set_epoch(77);
    open(vector.channel, 0, vector.timed != 0);
  }
};

TEST_F(RepairPackets, AreTwoMessagesWithFiveParityPackets) {
  ASSERT_EQ(vectors_.size(), 2u);
  for (const Vector& vector : vectors_) EXPECT_EQ(vector.parity.size(), vector.parities);
}

TEST_F(RepairPackets, AreCountedAndNotTakenBySomebodyWhoDoesNotKnowThem) {
  for (const Vector& vector : vectors_) {
    OldRobot robot(vector);
    for (const Bytes& packet : vector.parity) EXPECT_EQ(robot.hear(packet), Error::kBadPacket);
    EXPECT_TRUE(robot.received.empty());
    EXPECT_TRUE(robot.pull_all().empty()) << "none is sent on";
    for (const Bytes& packet : vector.packets) EXPECT_EQ(robot.hear(packet), Error::kOk);
    for (const Bytes& packet : vector.parity) EXPECT_EQ(robot.hear(packet), Error::kBadPacket);
    ASSERT_EQ(robot.received.size(), 1u) << vector.name;
    EXPECT_EQ(robot.received[0].bytes, vector.message());
    EXPECT_EQ(robot.pull_all().size(), vector.packets.size()) << "the packets alone are sent on";
    EXPECT_EQ(robot.node.counters().bad_packets, 2 * vector.parity.size());
    EXPECT_EQ(robot.node.counters().contradictions, 0u);
    EXPECT_EQ(robot.node.counters().id_collisions, 0u);
  }
}

TEST_F(RepairPackets, DoNotMakeAMessageWholeForSomebodyWhoDoesNotKnowThem) {
  for (const Vector& vector : vectors_) {
    OldRobot robot(vector);
    for (const Bytes& packet : vector.parity) robot.hear(packet);
    for (std::size_t i = 1; i < vector.packets.size(); ++i) robot.hear(vector.packets[i]);
    for (const Bytes& packet : vector.parity) robot.hear(packet);
    EXPECT_TRUE(robot.received.empty());
    robot.hear(vector.packets[0]);
    ASSERT_EQ(robot.received.size(), 1u);
    EXPECT_EQ(robot.received[0].bytes, vector.message());
  }
}

// What stands in bits that are 0 otherwise goes on with the packet, and is read by who knows it.
TEST_F(RepairPackets, KeepTheirMarkWhenSomebodySendsOnWhoDoesNotKnowIt) {
  for (const Vector& vector : vectors_) {
    OldRobot robot(vector);
    robot.hear(vector.packets[0]);
    const std::vector<Bytes> sent_on = robot.pull_all();
    ASSERT_EQ(sent_on.size(), 1u);
    EXPECT_EQ(sent_on[0][16], vector.packets[0][16]);
  }
}

#ifndef SWARMTALK_NODE_ALONE
TEST_F(RepairPackets, AreMadeBitForBit) {
  for (const Vector& vector : vectors_) {
    TestNode<Wifi> robot(static_cast<uint16_t>(vector.node));
    robot.node.set_epoch(static_cast<uint16_t>(vector.epoch));
    ASSERT_NE(robot.open(vector.channel, vector.ttl, vector.timed != 0), nullptr);
    const Bytes message = vector.message();
    ASSERT_EQ(robot.publisher->send(message.data(), static_cast<uint16_t>(message.size())),
              Error::kOk);
    redundancy::RepairSender sender;
    sender.protect(static_cast<uint16_t>(vector.channel), vector.number, vector.parities);
    std::vector<Bytes> packets;
    for (uint64_t frame = 1; robot.node.has_packet(); ++frame) {
      packets.push_back(robot.pull());
      sender.sent(packets.back(), frame, 0);
    }
    EXPECT_EQ(packets, vector.packets);
    std::vector<Bytes> parities;
    while (sender.has_parity()) {
      Bytes& parity = parities.emplace_back(Wifi::kMtuBytes);
      parity.resize(sender.take_parity(parity, 0));
    }
    EXPECT_EQ(parities, vector.parity);
  }
}

TEST_F(RepairPackets, MakeUpForAnyPacketsThatAreAsMany) {
  for (const Vector& vector : vectors_) {
    std::vector<Bytes> all = vector.packets;
    all.insert(all.end(), vector.parity.begin(), vector.parity.end());
    const auto needed = static_cast<int>(vector.packets.size());
    int ways = 0;
    for (unsigned mask = 0; mask < 1u << all.size(); ++mask) {
      if (__builtin_popcount(mask) != needed) continue;
      OldRobot robot(vector);
      redundancy::Recoverer recoverer;
      for (std::size_t i = 0; i < all.size(); ++i) {
        if ((mask >> i & 1) == 0) continue;
        const redundancy::Header header = redundancy::Wire::decode(all[i].data());
        ASSERT_TRUE(redundancy::is_marked(all[i]));
        EXPECT_EQ(redundancy::is_parity(all[i], header), i >= vector.packets.size());
        robot.hear(all[i]);
        for (const Bytes& known : recoverer.add(all[i], header, 0)) {
          EXPECT_NE(std::find(vector.packets.begin(), vector.packets.end(), known),
                    vector.packets.end());
          EXPECT_EQ(robot.hear(known), Error::kOk);
        }
      }
      ASSERT_EQ(robot.received.size(), 1u) << vector.name << " " << mask;
      EXPECT_EQ(robot.received[0].bytes, vector.message());
      ++ways;
    }
    EXPECT_GT(ways, 5);
  }
}
#endif

}  // namespace
}  // namespace swarmtalk::core::testing
