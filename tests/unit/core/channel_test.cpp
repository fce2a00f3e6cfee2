#include "swarmtalk/channel.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "swarmtalk/profiles/kilobot.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

using testing::pattern;

struct Several : Kilobot {
  static constexpr uint8_t kPublishers = 3;
  static constexpr uint8_t kSubscribers = 2;
};
using Node = testing::TestNode<Several>;

TEST(Channel, GivesAsManyPublishersAndSubscribersAsTheProfileHas) {
  Node node(1);
  auto* channel = node.node.new_channel(0, 0, false);
  for (int i = 0; i < 3; ++i) EXPECT_NE(channel->new_publisher(nullptr, nullptr), nullptr);
  EXPECT_EQ(channel->new_publisher(nullptr, nullptr), nullptr);
  EXPECT_EQ(channel->new_publisher(nullptr), nullptr);
  for (int i = 0; i < 2; ++i) EXPECT_NE(channel->new_subscriber(1, nullptr, nullptr), nullptr);
  EXPECT_EQ(channel->new_subscriber(1, nullptr, nullptr), nullptr);
  EXPECT_EQ(channel->new_subscriber(1, nullptr), nullptr);
}

TEST(Channel, TellsWhatItWasMadeWith) {
  Node node(1);
  auto* plain = node.node.new_channel(7, 15, false);
  auto* timed = node.node.new_channel(8, 0, true);
  EXPECT_EQ(plain->id(), 7);
  EXPECT_EQ(plain->ttl(), 15);
  EXPECT_FALSE(plain->is_timestamped());
  EXPECT_EQ(plain->max_message_bytes(), 40);
  EXPECT_TRUE(timed->is_timestamped());
  EXPECT_EQ(timed->max_message_bytes(), 24);
}

TEST(Channel, NumbersItsMessagesOneByOneAndAroundTheWrap) {
  Node node(1);
  node.open(0);
  uint8_t expected = 1;
  for (int message = 0; message < 40; ++message) {
    node.publisher->send(pattern(1).data(), 1);
    EXPECT_EQ(Wire<Several>::decode(node.pull().data()).message, expected);
    expected = static_cast<uint8_t>((expected + 1) % 16);
  }
}

/// Publishers that send whenever they may: each notes its letter.
struct Eager {
  Publisher<Several>* publisher = nullptr;
  char letter = 0;
  std::string* order = nullptr;
  static void on_sent(void* self) {
    auto* eager = static_cast<Eager*>(self);
    const uint8_t byte = 1;
    if (eager->publisher->send(&byte, 1) == Error::kOk) *eager->order += eager->letter;
  }
};
TEST(Channel, LetsAnotherPublisherBeFirstEachTime) {
  Node node(1);
  auto* channel = node.node.new_channel(0, 0, false);
  std::string order;
  Eager eager[3];
  for (int i = 0; i < 3; ++i) {
    eager[i].letter = static_cast<char>('a' + i);
    eager[i].order = &order;
    eager[i].publisher = channel->new_publisher(&Eager::on_sent, &eager[i]);
  }
  Eager::on_sent(&eager[0]);
  for (int i = 0; i < 9; ++i) node.pull();
  for (char letter : {'a', 'b', 'c'}) {
    EXPECT_GE(std::count(order.begin(), order.end(), letter), 3) << order;
  }
}

/// As many as there can be.
struct Crowded : Kilobot {
  static constexpr uint8_t kPublishers = 255;
  static constexpr uint8_t kSubscribers = 255;
};

TEST(Channel, TellsEachOf255PublishersAndSubscribersOnce) {
  testing::TestNode<Crowded> node(1);
  testing::TestNode<Crowded> other(2);
  auto* channel = node.node.new_channel(0, 0, false);
  int heard[255] = {};
  int sent[255] = {};
  Publisher<Crowded>* last = nullptr;
  const auto add = [](void* count) { ++*static_cast<int*>(count); };
  for (int i = 0; i < 255; ++i) {
    last = channel->new_publisher(add, &sent[i]);
    ASSERT_NE(last, nullptr);
    ASSERT_NE(channel->new_subscriber(
                  1,
                  [](void* count, const uint8_t*, uint16_t, const Reception<Crowded>&) {
                    ++*static_cast<int*>(count);
                  },
                  &heard[i]),
              nullptr);
  }
  EXPECT_EQ(channel->new_publisher(add, nullptr), nullptr);
  EXPECT_EQ(channel->new_subscriber(1, nullptr, nullptr), nullptr);
  other.open(0);
  for (int message = 1; message <= 300; ++message) {
    ASSERT_EQ(last->send(pattern(1).data(), 1), Error::kOk);
    node.pull();
    ASSERT_EQ(std::count(sent, sent + 255, message), 255) << "message " << message;
  }
  other.publisher->send(pattern(1).data(), 1);
  node.hear(other.pull());
  EXPECT_EQ(std::count(heard, heard + 255, 1), 255);
}

TEST(Channel, KeepsTheIdAMessageBeganWith) {
  testing::TestNode<Several> node;
  node.open(0);
  const auto before = node.node.node_id();
  node.publisher->send(pattern(15).data(), 15);
  EXPECT_EQ(Wire<Several>::decode(node.pull().data()).node, before);
  testing::TestNode<Several> twin(static_cast<uint16_t>(before));
  twin.open(0);
  twin.publisher->send(pattern(5).data(), 5);
  node.hear(twin.pull());
  ASSERT_NE(node.node.node_id(), before);
  EXPECT_EQ(Wire<Several>::decode(node.pull().data()).node, before);
  EXPECT_EQ(Wire<Several>::decode(node.pull().data()).node, before);
  node.publisher->send(pattern(5).data(), 5);
  EXPECT_EQ(Wire<Several>::decode(node.pull().data()).node, node.node.node_id());
}

}  // namespace
}  // namespace swarmtalk::core
