#include "sim/event_queue.hpp"

#include <gtest/gtest.h>

#include <set>

#include "sim/random.hpp"

namespace swarmtalk::sim {
namespace {

TEST(EventQueue, GivesTheOrderOfASortedSetForNearAndFarEvents) {
  EventQueue queue;
  std::set<std::pair<uint64_t, uint32_t>> model;
  Random random(7);
  uint64_t now = 0;
  uint32_t number = 0;
  for (int round = 0; round < 20000; ++round) {
    if (round < 10000 || !model.empty()) {
      const uint32_t reach = round % 3 == 0 ? 500 : round % 3 == 1 ? 100000 : 9000000;
      if (round < 10000) {
        const uint64_t at = now + random.below(reach);
        queue.push(at, number);
        model.insert({at, number++});
      }
      if (round % 2 == 0 || round >= 10000) {
        Event event{};
        ASSERT_TRUE(queue.pop(UINT64_MAX / 2, event));
        ASSERT_EQ(std::make_pair(event.at_us, event.what), *model.begin());
        model.erase(model.begin());
        now = event.at_us;
      }
    }
  }
}

TEST(EventQueue, KeepsWhatIsDueLater) {
  EventQueue queue;
  queue.push(5000, 1);
  Event event{};
  EXPECT_FALSE(queue.pop(4999, event));
  queue.push(4999, 2);
  EXPECT_TRUE(queue.pop(4999, event));
  EXPECT_EQ(event.what, 2u);
  EXPECT_TRUE(queue.pop(5000, event));
  EXPECT_EQ(event.what, 1u);
}

}  // namespace
}  // namespace swarmtalk::sim
