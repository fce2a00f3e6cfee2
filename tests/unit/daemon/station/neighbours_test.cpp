// The neighbour table in virtual time.
#include "daemon/station/neighbours.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;

class NeighboursTest : public testing::Test {
 protected:
  Neighbours::Duplicate hear(std::uint16_t node, std::uint32_t epoch, std::uint32_t counter,
                             std::uint64_t hardware = 1, bool has_ours = false,
                             bool is_ghost = false) {
    drivers::FrameReception frame;
    frame.has_our_hardware = has_ours;
    frame.is_ghost = is_ghost;
    frame.transmitter = node;
    frame.transmitter_epoch = epoch;
    frame.frame_counter = counter;
    frame.hardware = hardware;
    frame.received_at = now_ += 1us;
    return table_.heard(frame, Range{2.0f, 0.5f}, false);
  }
  std::vector<Neighbour> list() { return table_.list(now_); }

  Neighbours table_;
  Neighbours::Time now_{1000s};
};

TEST_F(NeighboursTest, ListsThoseHeardLatelyById) {
  hear(9, 1, 1);
  now_ += 3s;
  hear(4, 1, 1);
  ASSERT_EQ(list().size(), 2u);
  EXPECT_EQ(list()[0].node, 4);
  EXPECT_EQ(list()[1].range.distance_m, 2.0f);
  now_ += 8s;
  ASSERT_EQ(list().size(), 1u) << "robot 9 was heard 11 s ago";
}

TEST_F(NeighboursTest, GapsInTheCountOfFramesAreLoss) {
  hear(9, 1, 100);
  EXPECT_EQ(list()[0].loss(), 0.0) << "what was before the first is not known";
  hear(9, 1, 101);
  hear(9, 1, 104);
  EXPECT_EQ(list()[0].frames_lost, 2u);
  EXPECT_DOUBLE_EQ(list()[0].loss(), 0.4);
  EXPECT_EQ(list()[0].loss_frames(), 5u);
}

TEST_F(NeighboursTest, LossOfLongAgoIsForgotten) {
  hear(9, 1, 1);
  hear(9, 1, 11);
  for (std::uint32_t i = 12; i < 30; ++i) {
    now_ += 1s;
    hear(9, 1, i);
  }
  EXPECT_EQ(list()[0].loss(), 0.0);
  EXPECT_LE(list()[0].loss_frames(), 10u);
  EXPECT_EQ(list()[0].frames_lost, 9u);
}

TEST_F(NeighboursTest, MadeUpFrameFarAheadIsNoLoss) {
  std::uint32_t counter = 1;
  for (int i = 0; i < 50; ++i) {  // 50 a second, and a stranger's after every tenth
    hear(9, 1, counter++);
    if (i % 10 == 9) hear(9, 1, counter + 9000);
    now_ += 20ms;
  }
  EXPECT_EQ(list()[0].frames_lost, 0u);
  hear(9, 1, counter + 3);
  EXPECT_EQ(list()[0].frames_lost, 3u) << "and the count has not moved";
}

TEST_F(NeighboursTest, NineOfTenFramesLostAreCounted) {
  for (std::uint32_t counter = 1; counter <= 2001; counter += 10) {
    hear(9, 1, counter);
    now_ += 200ms;
  }
  EXPECT_EQ(list()[0].frames_lost, 1800u);
}

TEST_F(NeighboursTest, FramesHeardTwiceOrLateAreNoLoss) {
  hear(9, 1, 1);
  hear(9, 1, 3);
  hear(9, 1, 2);
  hear(9, 1, 3);
  EXPECT_EQ(list()[0].frames_lost, 1u);
}

TEST_F(NeighboursTest, TwoRobotsUnderOneIdAreToldOnce) {
  hear(7, 1, 1, 0xA);
  EXPECT_EQ(hear(7, 2, 1, 0xB).older, nullptr) << "it may have restarted";
  const auto found = hear(7, 1, 2, 0xA);
  ASSERT_NE(found.older, nullptr);
  EXPECT_EQ(found.older->hardware, 0xAu);
  EXPECT_EQ(found.younger->hardware, 0xBu);
  EXPECT_EQ(hear(7, 2, 2, 0xB).older, nullptr);
  EXPECT_EQ(hear(7, 1, 3, 0xA).older, nullptr);
  EXPECT_TRUE(list()[0].is_duplicate && list()[1].is_duplicate);
}

TEST_F(NeighboursTest, TwoRobotsUnderOneIdAndOneAddressAreToldWhenNoFrameCanBeLate) {
  hear(7, 1, 1, 0xA);
  hear(7, 2, 1, 0xA);
  EXPECT_EQ(hear(7, 1, 2, 0xA).older, nullptr) << "an access point may have held it";
  now_ += Neighbours::kLongestHeld - 1s;
  hear(7, 2, 2, 0xA);
  EXPECT_EQ(hear(7, 1, 3, 0xA).older, nullptr);
  EXPECT_FALSE(list()[0].is_duplicate);
  now_ += 1s;
  const auto found = hear(7, 1, 4, 0xA);
  ASSERT_NE(found.older, nullptr);
  EXPECT_EQ(found.older->epoch, 1u);
  EXPECT_EQ(found.younger->epoch, 2u);
  EXPECT_EQ(hear(7, 1, 5, 0xA).older, nullptr);
  EXPECT_TRUE(list()[0].is_duplicate && list()[1].is_duplicate);
}

TEST_F(NeighboursTest, RobotThatRestartsAgainAndAgainIsNoDuplicate) {
  for (std::uint32_t epoch = 1; epoch <= 20; ++epoch) {
    now_ += 1s;
    EXPECT_EQ(hear(7, epoch, 1, 0xA).older, nullptr);
    EXPECT_EQ(hear(7, epoch, 2, 0xA).older, nullptr);
  }
  ASSERT_EQ(list().size(), 1u);
  EXPECT_EQ(list()[0].epoch, 20u);
  hear(7, 19, 3, 0xA);  // late
  EXPECT_EQ(list().size(), 1u);
  hear(7, 19, 4, 0xB);  // another robot
  ASSERT_EQ(list().size(), 2u);
  EXPECT_TRUE(list()[0].is_duplicate && list()[1].is_duplicate);
}

TEST_F(NeighboursTest, RobotThatRestartsBesideAnotherOfItsIdIsListedOnce) {
  std::uint32_t counter = 0;
  for (std::uint32_t epoch = 2; epoch <= 6; ++epoch) {
    for (int i = 0; i < 4; ++i) {
      now_ += 200ms;
      hear(7, 1, ++counter, 0xB);
      hear(7, epoch, static_cast<std::uint32_t>(i), 0xA);
    }
  }
  ASSERT_EQ(list().size(), 2u);
  EXPECT_EQ(list()[0].epoch, 1u);
  EXPECT_EQ(list()[1].epoch, 6u);
  EXPECT_TRUE(list()[0].is_duplicate && list()[1].is_duplicate);
}

TEST_F(NeighboursTest, RobotWithOurOwnAddressIsToldOnce) {
  EXPECT_EQ(hear(7, 1, 1, 0xA, false).double_of_us, nullptr);
  EXPECT_EQ(hear(8, 1, 1, 0xB, true, true).double_of_us, nullptr) << "a ghost";
  const auto found = hear(9, 1, 1, 0xB, true);
  ASSERT_NE(found.double_of_us, nullptr);
  EXPECT_EQ(found.double_of_us->node, 9);
  EXPECT_EQ(hear(9, 1, 2, 0xB, true).double_of_us, nullptr);
  EXPECT_NE(hear(9, 2, 1, 0xB, true).double_of_us, nullptr) << "it has restarted";
}

TEST_F(NeighboursTest, DuplicateIsNoneWhenTheOtherIsGone) {
  hear(7, 1, 1, 0xA);
  hear(7, 2, 1, 0xB);
  hear(7, 1, 2, 0xA);
  now_ += 11s;
  hear(7, 2, 2, 0xB);
  ASSERT_EQ(list().size(), 1u);
  EXPECT_FALSE(list()[0].is_duplicate);
}

TEST_F(NeighboursTest, RestartedRobotIsNoDuplicate) {
  hear(7, 1, 1, 0xA);
  hear(7, 2, 1, 0xC);  // with another interface even
  hear(7, 2, 2, 0xC);
  EXPECT_FALSE(list()[0].is_duplicate);
}

TEST_F(NeighboursTest, RobotHeardOverTwoInterfacesIsNoDuplicate) {
  hear(7, 1, 1, 0xA);
  hear(7, 1, 1, 0xB);
  hear(7, 1, 2, 0xA);
  ASSERT_EQ(list().size(), 1u);
  EXPECT_FALSE(list()[0].is_duplicate);
}

TEST_F(NeighboursTest, AddressIsTheOneHeardFromLast) {
  hear(7, 1, 1, 0xA);
  hear(7, 1, 2, 0xB);
  hear(7, 1, 3, 0);  // not known
  ASSERT_EQ(list().size(), 1u);
  EXPECT_EQ(list()[0].hardware, 0xBu);
}

TEST_F(NeighboursTest, LongestUnheardMakesPlaceAndIsCounted) {
  for (std::size_t i = 0; i <= Neighbours::kMost; ++i) {
    hear(static_cast<std::uint16_t>(i + 1), 1, 1);
    now_ += 1ms;
  }
  EXPECT_EQ(list().size(), Neighbours::kMost);
  EXPECT_EQ(list()[0].node, 2);
  EXPECT_EQ(table_.evicted(), 1u);
}

}  // namespace
}  // namespace swarmtalk::daemon
