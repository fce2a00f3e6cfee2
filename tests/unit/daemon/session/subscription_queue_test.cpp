#include "daemon/session/subscription_queue.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

class Queue : public testing::Test {
 protected:
  MessageRef message(std::uint32_t number, std::size_t bytes = 1) {
    MessageHead head;
    head.number = number;
    const std::vector<std::uint8_t> payload(bytes, 'x');
    return pool_.take(head, payload, false);
  }

  MessagePool pool_;
};

TEST_F(Queue, KeepsOrder) {
  SubscriptionQueue queue(100);
  for (std::uint32_t i = 0; i < 30; ++i) EXPECT_FALSE(queue.push(message(i)));
  for (std::uint32_t i = 0; i < 30; ++i) EXPECT_EQ(queue.pop().message->number, i);
  EXPECT_TRUE(queue.is_empty());
}

TEST_F(Queue, DropsTheOldestAndTellsTheNextHowMany) {
  SubscriptionQueue queue(3);
  for (std::uint32_t i = 1; i <= 5; ++i) EXPECT_EQ(queue.push(message(i)), i > 3);
  const auto first = queue.pop();
  EXPECT_EQ(first.message->number, 3u);
  EXPECT_EQ(first.lost_before.daemon, 2u);
  EXPECT_EQ(queue.pop().lost_before, Loss{});
}

TEST_F(Queue, OfOneKeepsTheLatest) {
  SubscriptionQueue queue(1);
  for (std::uint32_t i = 1; i <= 1000; ++i) queue.push(message(i));
  const auto taken = queue.pop();
  EXPECT_EQ(taken.message->number, 1000u);
  EXPECT_EQ(taken.lost_before.daemon, 999u);
}

TEST_F(Queue, CountsMessagesThatNeverGotIn) {
  SubscriptionQueue queue(3);
  queue.count_dropped();
  queue.push(message(2));
  EXPECT_EQ(queue.pop().lost_before.daemon, 1u);
}

TEST_F(Queue, CarriesTheLossOfWhatItDrops) {
  SubscriptionQueue queue(1);
  queue.note({5, 0, 0, 0});
  queue.push(message(1));
  queue.note({0, 2, 0, 1});
  queue.push(message(2));
  EXPECT_EQ(queue.pop().lost_before, (Loss{5, 2, 1, 1}));
}

TEST_F(Queue, CarriesTheLossOfTheLastItDropsToTheNextPushed) {
  SubscriptionQueue queue(3);
  queue.note({5, 0, 0, 0});
  queue.push(message(1));
  queue.drop_oldest();
  queue.push(message(2));
  EXPECT_EQ(queue.pop().lost_before, (Loss{5, 0, 1, 0}));
}

TEST_F(Queue, KeepsTheNewestOfEachSender) {
  SubscriptionQueue queue(8, true);
  const auto push = [&](std::uint16_t sender, std::uint32_t number) {
    MessageRef of_sender = message(number, number);
    of_sender->sender = sender;
    return queue.push(of_sender);
  };
  EXPECT_FALSE(push(1, 1));
  EXPECT_FALSE(push(2, 2));
  queue.note({3, 0, 0, 0});
  EXPECT_FALSE(push(3, 3));
  EXPECT_TRUE(push(1, 4));
  EXPECT_TRUE(push(3, 5));
  EXPECT_EQ(queue.size(), 3u);
  EXPECT_EQ(queue.payload_bytes(), 2u + 4u + 5u);
  const auto second = queue.pop();
  EXPECT_EQ(second.message->number, 2u);
  EXPECT_EQ(second.lost_before.daemon, 1u);
  const auto first = queue.pop();
  EXPECT_EQ(first.message->number, 4u);
  EXPECT_EQ(first.lost_before, (Loss{3, 0, 1, 0}));
  EXPECT_EQ(queue.pop().lost_before, Loss{});
}

TEST_F(Queue, KnowsItsBytes) {
  SubscriptionQueue queue(3);
  for (std::uint32_t i = 1; i <= 4; ++i) queue.push(message(i, 10 * i));
  EXPECT_EQ(queue.payload_bytes(), 20u + 30u + 40u);
  queue.pop();
  EXPECT_EQ(queue.payload_bytes(), 70u);
  queue.drop_oldest();
  EXPECT_EQ(queue.payload_bytes(), 40u);
}

TEST_F(Queue, GrowsWhileWrappedAround) {
  SubscriptionQueue queue(64);
  std::uint32_t in = 0;
  std::uint32_t out = 0;
  for (int round = 0; round < 50; ++round) {
    for (int i = 0; i < 5 && queue.size() < 60; ++i) queue.push(message(in++));
    for (int i = 0; i < 3; ++i) EXPECT_EQ(queue.pop().message->number, out++);
  }
}

}  // namespace
}  // namespace swarmtalk::daemon
