#include "swarmtalk/node_id.hpp"

#include <gtest/gtest.h>

#include <set>

#include "swarmtalk/profiles/kilobot.hpp"

namespace swarmtalk::core {
namespace {

uint32_t next = 0;
const Port kCounting = {[](void*) { return 0u; }, [](void*) { return next++; }, nullptr};
const Port kStuck = {[](void*) { return 0u; }, [](void*) { return 5u; }, nullptr};

TEST(NodeIdentity, NeverDrawsThePresentIdOrAGateways) {
  NodeIdentity<Kilobot> sut;
  uint8_t before = 255;
  for (int i = 0; i < 1000; ++i) {
    sut.draw(kCounting, [](uint8_t) { return false; });
    EXPECT_LT(sut.id(), 248);
    EXPECT_NE(sut.id(), before);
    before = sut.id();
  }
}

TEST(NodeIdentity, AvoidsIdsHeardLately) {
  NodeIdentity<Kilobot> sut;
  next = 0;
  sut.draw(kCounting, [](uint8_t id) { return id < 6; });
  EXPECT_EQ(sut.id(), 6);
}

TEST(NodeIdentity, MovesOnEvenWithoutRandomness) {
  NodeIdentity<Kilobot> sut;
  sut.draw(kStuck, [](uint8_t) { return false; });
  EXPECT_EQ(sut.id(), 5);
  sut.draw(kStuck, [](uint8_t) { return false; });
  EXPECT_EQ(sut.id(), 6);
}

}  // namespace
}  // namespace swarmtalk::core
