#include "swarmtalk/sensing.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "swarmtalk/profiles/footbot.hpp"
#include "tests/unit/core/test_node.hpp"

namespace swarmtalk::core {
namespace {

TEST(Sensing, PassesWhatIsNearerThanTheLimitAndNothingAtIt) {
  EXPECT_TRUE((DistanceSensing{99}.is_within(100)));
  EXPECT_FALSE((DistanceSensing{100}.is_within(100)));
  EXPECT_TRUE((RangeBearingSensing{99, 0}.is_within(100)));
  EXPECT_FALSE((RangeBearingSensing{100, 0}.is_within(100)));
  EXPECT_TRUE((PoseSensing{0.999f, 0, 0}.is_within(1)));
  EXPECT_FALSE((PoseSensing{1, 0, 0}.is_within(1)));
}

TEST(Sensing, PassesTheUnknown) {
  EXPECT_TRUE((DistanceSensing{-1}.is_within(1)));
  EXPECT_TRUE((RangeBearingSensing{-1, 0}.is_within(1)));
  EXPECT_TRUE((PoseSensing{NAN, NAN, 0}.is_within(0)));
}

/// A platform may measure what it likes, and filter by what it likes.
struct SmellSensing {
  using Distance = uint8_t;  // here the weakest smell that counts
  uint8_t smell;
  double temperature;
  char colour[3];
  bool is_within(Distance weakest) const { return smell >= weakest; }
};
struct Nose : ProfileDefaults {
  using Sensing = SmellSensing;
};

TEST(Sensing, IsWhateverAPlatformDefines) {
  testing::TestNode<Nose> sender(1);
  testing::TestNode<Nose> receiver(2);
  sender.open(0);
  receiver.open(0);  // weakest smell 100
  const SmellSensing weak = {99, 0, {1, 2, 3}};
  const SmellSensing strong = {100, 36.6, {4, 5, 6}};
  sender.publisher->send(testing::pattern(5).data(), 5);
  receiver.hear(sender.pull(), weak);
  EXPECT_TRUE(receiver.received.empty());
  sender.publisher->send(testing::pattern(5).data(), 5);
  receiver.hear(sender.pull(), strong);
  ASSERT_EQ(receiver.received.size(), 1u);
  EXPECT_EQ(receiver.received[0].reception.sensing.temperature, 36.6);
  EXPECT_EQ(receiver.received[0].reception.sensing.colour[2], 6);
}

}  // namespace
}  // namespace swarmtalk::core
