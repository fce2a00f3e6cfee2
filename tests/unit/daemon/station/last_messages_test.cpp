#include "daemon/station/last_messages.hpp"

#include <gtest/gtest.h>

#include <array>

namespace swarmtalk::daemon {
namespace {

TEST(LastMessages, HaveTheirTurnsWhereABeaconHasRoomForSome) {
  LastMessages last;
  last.of(3) = 30;
  last.of(1) = 10;
  last.of(2) = 20;
  std::array<frame::LastMessage, 2> out{};
  ASSERT_EQ(last.take(out), 2u);
  EXPECT_EQ(out[0].channel, 1);
  EXPECT_EQ(out[1].channel, 2);
  ASSERT_EQ(last.take(out), 2u);
  EXPECT_EQ(out[0].channel, 3);
  EXPECT_EQ(out[0].number, 30u);
  EXPECT_EQ(out[1].channel, 1);
}

TEST(LastMessages, AreNotToldTwiceInOneBeacon) {
  LastMessages last;
  std::array<frame::LastMessage, 4> out{};
  EXPECT_EQ(last.take(out), 0u);
  last.of(7) = 1;
  EXPECT_EQ(last.take(out), 1u);
}

}  // namespace
}  // namespace swarmtalk::daemon
