#include "daemon/message/message.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

TEST(MessagePool, ReusesTheMemoryOfAMessage) {
  MessagePool pool;
  MessageRef first = pool.take({}, bytes_of(std::string(5000, 'x')), false);
  const void* block = &*first;
  first.reset();
  MessageRef second = pool.take({}, {}, false);
  EXPECT_EQ(&*second, block);
  EXPECT_TRUE(second->payload.empty());
  EXPECT_GE(second->payload.capacity(), 5000u);
}

TEST(MessagePool, LeavesNothingOfTheMessageBefore) {
  MessagePool pool;
  MessageHead full;
  full.buffering_delay_us = 5;
  full.crossed_gateway = true;
  full.origin = GatewayOrigin{"other", 1, 2, 3};
  full.distance_m = 4.0f;
  MessageRef first = pool.take(full, bytes_of("full"), true);
  const void* block = &*first;
  first.reset();
  const MessageRef second = pool.take({}, bytes_of("x"), false);
  ASSERT_EQ(&*second, block);
  EXPECT_EQ(second->payload, "x");
  EXPECT_FALSE(second->is_local);
  EXPECT_FALSE(second->buffering_delay_us);
  EXPECT_FALSE(second->crossed_gateway);
  EXPECT_FALSE(second->origin);
  EXPECT_NE(second->distance_m, second->distance_m);  // NaN
}

TEST(MessageRef, KeepsTheMessageUntilTheLastOneGoes) {
  MessagePool pool;
  MessageHead head;
  head.number = 7;
  MessageRef first = pool.take(head, {}, false);
  MessageRef copy = first;
  first.reset();
  EXPECT_EQ(copy->number, 7u);
  MessageRef other = pool.take({}, {}, false);
  EXPECT_NE(&*other, &*copy);
  copy = other;
  EXPECT_EQ(&*other, &*copy);
}

}  // namespace
}  // namespace swarmtalk::daemon
