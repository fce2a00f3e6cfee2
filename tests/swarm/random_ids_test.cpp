// Swarms whose robots draw their ids: how often two under one id splice their messages.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/support/profiles.hpp"
#include "tests/swarm/cells.hpp"
#include "tests/swarm/one_hop.hpp"
#include "tests/swarm/splice_model.hpp"

namespace swarmtalk::core::testing {
namespace {

TEST(RandomIds, SettleSoThatNeighboursDiffer) {
  OneHopConfig config = one_hop({3.2, 0.05, 2});
  config.distinct_ids = false;
  OneHop<RoomForAll> scenario(config);
  scenario.run();
  auto& swarm = scenario.swarm();
  for (uint32_t i = 0; i < swarm.size(); ++i) {
    for (uint32_t j : swarm.disk().neighbours(i)) {
      EXPECT_NE(swarm.robot(i).node.node_id(), swarm.robot(j).node.node_id());
    }
  }
}

class RandomIdsCell : public ::testing::TestWithParam<Cell> {};

/// Within four standard errors of the mean over seeds, which is known to a third at least.
TEST_P(RandomIdsCell, SpliceAsOftenAsTheBirthdayProblemSays) {
  OneHopConfig config = one_hop(GetParam());
  config.seconds = 60;
  const double predicted = predicted_splices(config);
  const MeasuredSplices measured = measured_splices<RoomForAll>(config, 60);
  std::printf("predicted %.2f, measured %.2f, standard error %.2f, of %.0f deliveries\n", predicted,
              measured.mean, measured.error, measured.intact);
  ASSERT_LT(measured.error, predicted / 3);
  EXPECT_NEAR(measured.mean, predicted, 4 * measured.error);
}
INSTANTIATE_TEST_SUITE_P(Lossy, RandomIdsCell,
                         ::testing::Values(Cell{1.5, 0.2, 2}, Cell{3.2, 0.05, 2}, Cell{3.2, 0.2, 2},
                                           Cell{3.2, 0.2, 4}));

TEST(RandomIds, SpliceNothingWhereNothingIsLost) {
  for (uint8_t packets : {uint8_t{2}, uint8_t{8}}) {
    OneHopConfig config = one_hop({3.2, 0, packets});
    config.seconds = 60;
    EXPECT_EQ(predicted_splices(config), 0);
    EXPECT_EQ(measured_splices<RoomForAll>(config, 10).mean, 0);
  }
}

}  // namespace
}  // namespace swarmtalk::core::testing
