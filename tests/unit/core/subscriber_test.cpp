#include "swarmtalk/subscriber.hpp"

#include <gtest/gtest.h>

#include <string>

#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;

struct Several : Kilobot {
  static constexpr uint8_t kSubscribers = 3;
};
using Node = testing::TestNode<Several>;

void note(void* calls, const uint8_t*, uint16_t, const Reception<Several>&) {
  ++*static_cast<int*>(calls);
}
Bytes packet_from(uint16_t id) {
  Node sender(id);
  sender.open(0);
  sender.publisher->send(pattern(5).data(), 5);
  return sender.pull();
}

TEST(Subscriber, HearsNothingFromItsDistanceOn) {
  Node node(9);
  auto* channel = node.node.new_channel(0, 0, false);
  int near = 0;
  int far = 0;
  channel->new_subscriber(50, &note, &near);
  channel->new_subscriber(200, &note, &far);
  node.hear(packet_from(1), DistanceSensing{49});
  node.hear(packet_from(2), DistanceSensing{50});
  node.hear(packet_from(3), DistanceSensing{199});
  node.hear(packet_from(4), DistanceSensing{200});
  node.hear(packet_from(5), DistanceSensing{-1});  // unknown
  EXPECT_EQ(near, 2);
  EXPECT_EQ(far, 4);
  EXPECT_EQ(node.node.counters().too_far, 1);
}

TEST(Subscriber, TooFarCostsNoMemory) {
  Node node(250);
  node.open(0);
  for (uint16_t sender = 1; sender <= 200; ++sender) {  // ten times the records
    Node far(sender);
    far.open(0);
    far.publisher->send(pattern(10).data(), 10);
    node.hear(far.pull(), DistanceSensing{100});
  }
  EXPECT_EQ(node.node.counters().too_far, 200);
  EXPECT_EQ(node.node.counters().no_memory, 0);
  Node near(201);
  near.open(0);
  near.publisher->send(pattern(40).data(), 40);
  for (const Bytes& packet : near.pull_all()) node.hear(packet, DistanceSensing{99});
  ASSERT_EQ(node.received.size(), 1u);
  EXPECT_EQ(node.received[0].bytes, pattern(40));
}

std::string plain_heard;
void plain(unsigned char* message, int size, int ttl, DistanceSensing* sensing) {
  plain_heard = std::to_string(size) + " " + std::to_string(ttl) + " " +
                std::to_string(sensing->distance) + " " + std::to_string(message[0]);
  message[0] = 77;  // a program may write to both
  sensing->distance = 0;
}
TEST(Subscriber, HearsInThePapersShapeAndMayWriteToItsCopies) {
  Node node(9);
  auto* channel = node.node.new_channel(0, 0, false);
  int after = 0;
  channel->new_subscriber(100, &plain);
  channel->new_subscriber(100, &note, &after);
  node.hear(packet_from(1), DistanceSensing{33});
  EXPECT_EQ(plain_heard, "5 0 33 1");
  EXPECT_EQ(after, 1);
}

TEST(Subscriber, WithoutACallbackIsAllowedAndCounts) {
  Node node(9);
  auto* channel = node.node.new_channel(0, 0, false);
  channel->new_subscriber(100, nullptr, nullptr);
  channel->new_subscriber(100, nullptr);
  node.hear(packet_from(1));
  EXPECT_EQ(node.node.counters().messages_received, 1);
}

}  // namespace
}  // namespace swarmtalk::core
