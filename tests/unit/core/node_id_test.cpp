#include "swarmtalk/node_id.hpp"

#include <gtest/gtest.h>

#include <set>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

uint32_t next = 0;
const Port kCounting = {[](void*) { return 0u; }, [](void*) { return next++; }, nullptr};
const Port kStuck = {[](void*) { return 0u; }, [](void*) { return 5u; }, nullptr};

/// The ids below `limit` have been heard lately.
struct KnownBelow {
  uint8_t limit;
  bool knows_node(uint8_t id) const { return id < limit; }
};

TEST(NodeIdentity, NeverDrawsThePresentIdOrAGateways) {
  NodeIdentity<Kilobot> sut;
  uint8_t before = 255;
  for (int i = 0; i < 1000; ++i) {
    sut.draw(kCounting, KnownBelow{0});
    EXPECT_LT(sut.id(), 248);
    EXPECT_NE(sut.id(), before);
    before = sut.id();
  }
}

TEST(NodeIdentity, AvoidsIdsHeardLately) {
  NodeIdentity<Kilobot> sut;
  next = 0;
  sut.draw(kCounting, KnownBelow{1});
  EXPECT_EQ(sut.id(), 1);
}

TEST(NodeIdentity, IsDrawnAnewAndNotFixedUnderNobodysId) {
  NodeIdentity<Kilobot> sut;
  sut.fix(7, kStuck);
  EXPECT_TRUE(sut.is_fixed());
  sut.fix(Wire<Kilobot>::kNoNode, kStuck);
  EXPECT_FALSE(sut.is_fixed());
  EXPECT_FALSE(sut.is_drawn());
  sut.draw(kStuck, KnownBelow{0});
  EXPECT_EQ(sut.id(), 5);
}

TEST(NodeIdentity, MovesOnEvenWithoutRandomness) {
  NodeIdentity<Kilobot> sut;
  sut.draw(kStuck, KnownBelow{0});
  EXPECT_EQ(sut.id(), 5);
  sut.draw(kStuck, KnownBelow{0});
  EXPECT_EQ(sut.id(), 6);
}

}  // namespace
}  // namespace swarmtalk::core
