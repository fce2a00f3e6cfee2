#include "daemon/station/measured_loss.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace swarmtalk::daemon {
namespace {

using namespace std::chrono_literals;

class MeasuredLossTest : public ::testing::Test {
 protected:
  /// So many frames of a neighbour, of which each `every`th does not come; 0: all do.
  void hear(std::uint16_t node, int frames, int every) {
    std::uint32_t counter = 0;
    for (int i = 1; i <= frames; ++i) {
      ++counter;
      if (every != 0 && i % every == 0) continue;
      drivers::FrameReception frame;
      frame.transmitter = node;
      frame.frame_counter = counter;
      frame.received_at = now_;
      neighbours_.heard(frame, Range::unknown(), false);
    }
  }
  Neighbour::Time now_ = Neighbour::Time{} + 1h;
  Neighbours neighbours_;
  MeasuredLoss loss_;
};

TEST_F(MeasuredLossTest, IsNoneWhereNobodyIsHeard) {
  EXPECT_EQ(loss_.of(neighbours_, now_), 0);
}

TEST_F(MeasuredLossTest, IsWhatThreeOfFourNeighboursStayBelow) {
  hear(1, 101, 0);
  hear(2, 101, 10);
  hear(3, 101, 5);
  hear(4, 101, 2);
  EXPECT_NEAR(loss_.of(neighbours_, now_), 0.2, 0.01);
}

TEST_F(MeasuredLossTest, LooksAwayFromNeighboursOfFewFrames) {
  hear(1, 101, 10);
  hear(2, 11, 2);
  EXPECT_NEAR(loss_.of(neighbours_, now_), 0.1, 0.01);
}

TEST_F(MeasuredLossTest, IsLookedUpOnceASecond) {
  EXPECT_EQ(loss_.of(neighbours_, now_), 0);
  hear(1, 101, 5);
  EXPECT_EQ(loss_.of(neighbours_, now_ + 900ms), 0);
  EXPECT_GT(loss_.of(neighbours_, now_ + 1s), 0.15);
}

}  // namespace
}  // namespace swarmtalk::daemon
