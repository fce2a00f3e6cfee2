#include "sim/interference.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::sim {
namespace {

Body at(double x_mm, double y_mm) {
  Body body;
  body.x_mm = x_mm;
  body.y_mm = y_mm;
  return body;
}

Fault fault(Fault::Kind kind, uint64_t end_us) {
  Fault fault;
  fault.kind = kind;
  fault.end_us = end_us;
  fault.x_mm = 100;
  fault.y_mm = 50;
  fault.radius_mm = 10;
  return fault;
}

TEST(Interference, PartsWhatStandsOnTheTwoSidesOfALineUntilItsEnd) {
  Interference interference;
  EXPECT_FALSE(interference.parts(at(99, 0), at(100, 0), 0));
  EXPECT_TRUE(interference.begin(fault(Fault::Kind::kPartition, 1000)));
  EXPECT_TRUE(interference.parts(at(99, 0), at(100, 0), 999));
  EXPECT_TRUE(interference.parts(at(100, 0), at(99, 0), 999));
  EXPECT_FALSE(interference.parts(at(0, 0), at(99, 0), 999));
  EXPECT_FALSE(interference.parts(at(99, 0), at(100, 0), 1000));
  EXPECT_FALSE(interference.jams(at(100, 50), 0));
}

TEST(Interference, JamsWithinACircleUntilItsEnd) {
  Interference interference;
  EXPECT_TRUE(interference.begin(fault(Fault::Kind::kJam, 1000)));
  EXPECT_TRUE(interference.jams(at(110, 50), 999));
  EXPECT_FALSE(interference.jams(at(110, 51), 999));
  EXPECT_FALSE(interference.jams(at(100, 50), 1000));
  EXPECT_FALSE(interference.parts(at(0, 0), at(200, 0), 0));
}

TEST(Interference, EndsFaultsOfOneKind) {
  Interference interference;
  interference.begin(fault(Fault::Kind::kPartition, 1000));
  interference.begin(fault(Fault::Kind::kJam, 1000));
  interference.end(Fault::Kind::kPartition);
  EXPECT_FALSE(interference.parts(at(99, 0), at(100, 0), 0));
  EXPECT_TRUE(interference.jams(at(100, 50), 0));
  EXPECT_EQ(interference.active().size(), 1u);
}

TEST(Interference, LeavesOtherFaultsToTheWorld) {
  Interference interference;
  EXPECT_FALSE(interference.begin(fault(Fault::Kind::kDeath, 1000)));
  EXPECT_FALSE(interference.begin(fault(Fault::Kind::kClockStep, 1000)));
}

}  // namespace
}  // namespace swarmtalk::sim
