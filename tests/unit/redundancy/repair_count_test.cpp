#include "redundancy/repair_count.hpp"

#include <gtest/gtest.h>

namespace swarmtalk::redundancy {
namespace {

TEST(RepairCount, KnowsHowOftenMessagesArrive) {
  EXPECT_NEAR(delivery(4, 0, 0.2), 0.4096, 1e-12);
  EXPECT_NEAR(delivery(1, 1, 0.2), 0.96, 1e-12);
  EXPECT_NEAR(delivery(4, 3, 0.2), 0.966656, 1e-9);
  EXPECT_EQ(delivery(12, 3, 0), 1);
  EXPECT_EQ(delivery(2, 2, 1), 0);
}

TEST(RepairCount, IsAsSmallAsTheLossAllows) {
  EXPECT_EQ(repairs_for_loss(1, 0), 0u);
  EXPECT_EQ(repairs_for_loss(1, 0.04), 0u);
  EXPECT_EQ(repairs_for_loss(1, 0.2), 1u);
  EXPECT_EQ(repairs_for_loss(4, 0.2), 3u);
  for (unsigned packets = 1; packets <= 12; ++packets) {
    for (const double loss : {0.01, 0.05, 0.1, 0.2}) {
      const unsigned repairs = repairs_for_loss(packets, loss);
      EXPECT_GE(delivery(packets, repairs, loss), kWantedDelivery);
      if (repairs > 0) {
        EXPECT_LT(delivery(packets, repairs - 1, loss), kWantedDelivery);
      }
    }
  }
}

TEST(RepairCount, CostsNoMoreThanTheMessageAtAnyLoss) {
  EXPECT_EQ(repairs_for_loss(1, 0.9), 3u) << "they need no frames";
  for (unsigned packets = 2; packets <= 12; ++packets) {
    EXPECT_EQ(repairs_for_loss(packets, 0.9), packets);
  }
}

}  // namespace
}  // namespace swarmtalk::redundancy
