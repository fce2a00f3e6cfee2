#include "swarmtalk/publisher.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::Bytes;
using testing::pattern;
using Node = testing::TestNode<Kilobot>;

TEST(Publisher, TakesEverySizeTheChannelCarriesAndNoOther) {
  Node node(1);
  node.open(0);
  EXPECT_EQ(node.publisher->send(pattern(41).data(), 41), Error::kTooLong);
  EXPECT_EQ(node.publisher->send(nullptr, 0), Error::kEmpty);
  EXPECT_EQ(node.publisher->send(pattern(40).data(), 40), Error::kOk);
  EXPECT_EQ(node.pull_all().size(), 8u);
}

TEST(Publisher, TakesLessOnAChannelWithTimestamps) {
  Node node(1);
  auto* channel = node.open(8, 0, true);
  EXPECT_EQ(channel->max_message_bytes(), 24);
  EXPECT_EQ(node.publisher->send(pattern(25).data(), 25), Error::kTooLong);
  EXPECT_EQ(node.publisher->send(pattern(24).data(), 24), Error::kOk);
  EXPECT_EQ(node.pull_all().size(), 8u);
}

TEST(Publisher, TakesATtlOfItsOwnUpToTheFieldsMaximum) {
  Node node(1);
  node.open(0, 2);
  EXPECT_EQ(node.publisher->send(pattern(5).data(), 5, 16, false), Error::kTtlTooLarge);
  EXPECT_TRUE(node.publisher->available()) << "what is refused occupies nothing";
  EXPECT_EQ(node.publisher->send(pattern(5).data(), 5, 15, false), Error::kOk);
  EXPECT_EQ(Wire<Kilobot>::decode(node.pull().data()).ttl, 15);
  node.publisher->send(pattern(5).data(), 5);
  EXPECT_EQ(Wire<Kilobot>::decode(node.pull().data()).ttl, 2);
}

TEST(Publisher, IsBusyUntilItsChannelsLastPacketIsPulled) {
  Node node(1);
  node.open(0);
  EXPECT_TRUE(node.publisher->available());
  node.publisher->send(pattern(10).data(), 10);
  for (int packets = 0; packets < 2; ++packets) {
    EXPECT_FALSE(node.publisher->available());
    EXPECT_EQ(node.publisher->send(pattern(1).data(), 1), Error::kBusy);
    node.pull();
  }
  EXPECT_TRUE(node.publisher->available());
}

TEST(Publisher, KnowsItsChannelAndAllowsANullCallback) {
  Node node(1);
  auto* channel = node.node.new_channel(3, 0, false);
  auto* publisher = channel->new_publisher(nullptr);
  EXPECT_EQ(publisher->channel(), channel);
  EXPECT_EQ(publisher->channel()->id(), 3);
  publisher->send(pattern(1).data(), 1);
  EXPECT_EQ(node.pull().size(), 9u);
}

int plain_calls = 0;
TEST(Publisher, CallsAPlainFunctionToo) {
  plain_calls = 0;
  Node node(1);
  auto* publisher = node.node.new_channel(3, 0, false)->new_publisher([] { ++plain_calls; });
  publisher->send(pattern(6).data(), 6);
  node.pull();
  EXPECT_EQ(plain_calls, 0);
  node.pull();
  EXPECT_EQ(plain_calls, 1);
}

}  // namespace
}  // namespace swarmtalk::core
