#include "daemon/message/message.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

TEST(MessagePool, ReusesTheMemoryOfAMessage) {
  MessagePool pool;
  MessageRef first = pool.take();
  first->payload.assign(5000, 'x');
  const void* block = &*first;
  first.reset();
  MessageRef second = pool.take();
  EXPECT_EQ(&*second, block);
  EXPECT_TRUE(second->payload.empty());
  EXPECT_GE(second->payload.capacity(), 5000u);
}

TEST(MessageRef, KeepsTheMessageUntilTheLastOneGoes) {
  MessagePool pool;
  MessageRef first = pool.take();
  first->number = 7;
  MessageRef copy = first;
  first.reset();
  EXPECT_EQ(copy->number, 7u);
  MessageRef other = pool.take();
  EXPECT_NE(&*other, &*copy);
  copy = other;
  EXPECT_EQ(&*other, &*copy);
}

}  // namespace
}  // namespace swarmtalk::daemon
