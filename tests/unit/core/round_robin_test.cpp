#include "swarmtalk/round_robin.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::core {
namespace {

TEST(RoundRobin, GivesEachReadySourceItsTurn) {
  RoundRobin<3> sources;
  EXPECT_EQ(sources.next(), RoundRobin<3>::kNone);
  sources.set_ready(0, true);
  sources.set_ready(2, true);
  EXPECT_EQ(sources.next(), 0);
  EXPECT_EQ(sources.next(), 2);
  EXPECT_EQ(sources.next(), 0);
  sources.set_ready(1, true);
  EXPECT_EQ(sources.next(), 1);
  sources.set_ready(0, false);
  sources.set_ready(2, false);
  EXPECT_EQ(sources.next(), 1);
}

TEST(RoundRobin, VisitsEveryOneOfManySources) {
  RoundRobin<65> sources;
  for (uint8_t source :
       {uint8_t{0}, uint8_t{7}, uint8_t{8}, uint8_t{40}, uint8_t{63}, uint8_t{64}}) {
    sources.set_ready(source, true);
  }
  for (int round = 0; round < 3; ++round) {
    for (int expected : {0, 7, 8, 40, 63, 64}) EXPECT_EQ(sources.next(), expected);
  }
  for (uint8_t source = 0; source < 65; ++source) sources.set_ready(source, source == 33);
  EXPECT_EQ(sources.next(), 33);
  EXPECT_EQ(sources.next(), 33);
}

}  // namespace
}  // namespace swarmtalk::core
