#include "view/send_queue.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <random>

namespace swarmtalk::view {
namespace {

Outgoing outgoing(std::string text) {
  return {std::make_shared<const std::string>(std::move(text)), false};
}

std::string taken(SendQueue& queue) {
  const auto next = queue.take();
  return next ? *next->bytes : "nothing";
}

TEST(SendQueue, KeepsTheNewestStateOfAKindOnly) {
  SendQueue queue;
  queue.put_state(0, outgoing("old"));
  queue.put_state(0, outgoing("new"));
  queue.put_state(1, outgoing("other"));
  EXPECT_EQ(taken(queue), "new");
  EXPECT_EQ(taken(queue), "other");
  EXPECT_EQ(taken(queue), "nothing");
  EXPECT_EQ(queue.states_replaced(), 1u);
}

TEST(SendQueue, KeepsEventsInOrder) {
  SendQueue queue;
  for (const char* text : {"a", "b", "c"}) queue.put_event(outgoing(text));
  for (const char* text : {"a", "b", "c"}) EXPECT_EQ(taken(queue), text);
  EXPECT_EQ(queue.events_dropped(), 0u);
}

TEST(SendQueue, DropsTheOldestEventsBeyondTheirNumberAndCountsThem) {
  SendQueue queue;
  for (std::size_t i = 0; i < SendQueue::kMostEvents + 3; ++i) {
    queue.put_event(outgoing(std::to_string(i)));
  }
  EXPECT_EQ(queue.events_dropped(), 3u);
  EXPECT_EQ(taken(queue), "3");
}

TEST(SendQueue, DropsTheOldestEventsBeyondTheirBytes) {
  SendQueue queue;
  const std::string half(SendQueue::kMostEventBytes / 2 + 1, 'x');
  for (int i = 0; i < 3; ++i) queue.put_event(outgoing(half));
  EXPECT_EQ(queue.events_dropped(), 2u);
  EXPECT_EQ(taken(queue), half);
  EXPECT_EQ(taken(queue), "nothing");
}

TEST(SendQueue, OfRandomHistoriesKeepsTheNewestEventsThatThereIsRoomFor) {
  std::mt19937 random(1);
  for (int history = 0; history < 20; ++history) {
    SendQueue queue;
    std::deque<std::string> wanted;
    std::size_t bytes = 0, dropped = 0;
    const bool is_long = history % 2 == 0;  // bytes are the limit; else it is their number
    for (int i = 0; i < 6000; ++i) {
      if (random() % 5 < 2 && !wanted.empty()) {
        ASSERT_EQ(taken(queue), wanted.front()) << history << ", " << i;
        bytes -= wanted.front().size();
        wanted.pop_front();
        continue;
      }
      std::string text = std::to_string(i);
      if (is_long) text.append(random() % 30'000, 'x');
      bytes += text.size();
      wanted.push_back(text);
      queue.put_event(outgoing(std::move(text)));
      while (wanted.size() > SendQueue::kMostEvents || bytes > SendQueue::kMostEventBytes) {
        bytes -= wanted.front().size();
        wanted.pop_front();
        ++dropped;
      }
    }
    EXPECT_GT(dropped, 0u);
    EXPECT_EQ(queue.events_dropped(), dropped);
  }
}

TEST(SendQueue, ManyEventsDoNotHoldUpAState) {
  SendQueue queue;
  for (int i = 0; i < 100; ++i) queue.put_event(outgoing("event"));
  queue.put_state(0, outgoing("state"));
  const std::string first = taken(queue);
  EXPECT_TRUE(first == "state" || taken(queue) == "state");
}

TEST(SendQueue, StatesThatComeForEverDoNotHoldUpAnEvent) {
  SendQueue queue;
  queue.put_event(outgoing("event"));
  std::string all;
  for (int i = 0; i < 3; ++i) {
    queue.put_state(0, outgoing("state"));
    all += taken(queue);
  }
  EXPECT_NE(all.find("event"), std::string::npos) << all;
}

}  // namespace
}  // namespace swarmtalk::view
