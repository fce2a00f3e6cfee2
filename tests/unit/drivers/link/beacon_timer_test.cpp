// When a silent link is told to send a beacon.
#include "drivers/link/beacon_timer.hpp"

#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "loop/clock.hpp"
#include "tests/support/turned_clock.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

class BeaconTimerTest : public testing::Test {
 protected:
  boost::asio::io_context io_;
  int sent_ = 0;
  Beacon::Duration ahead_{0};
  std::optional<BeaconTimer> timer_{std::in_place, io_, [this](Beacon::Time) {
                                      if (ahead_ == 0ns) ++sent_;
                                      return std::exchange(ahead_, 0ns);
                                    }};
};

// Each silence lasts three quarters of the interval at least, and all of it at most.
TEST_F(BeaconTimerTest, CallsAgainAndAgainWhileTheLinkIsSilent) {
  timer_->set_interval(20ms);
  timer_->start();
  test::pass(io_, 14ms);
  EXPECT_EQ(sent_, 0);
  test::pass(io_, 6ms);
  EXPECT_EQ(sent_, 1);
  test::pass(io_, 60s);
  EXPECT_GE(sent_, 3001);
  EXPECT_LE(sent_, 4001);
}

TEST_F(BeaconTimerTest, RobotsDrawDifferentSilencesAndASeedTheSameAgain) {
  const auto first_silence = [this](std::uint64_t seed) {
    test::begin(seed);
    sent_ = 0;
    const auto begin = loop::now();
    timer_->set_interval(1h);
    timer_->start();
    EXPECT_TRUE(test::pass_until(
        io_, [&] { return sent_ == 1; }, 1h));
    return loop::now() - begin;
  };
  const auto silence = first_silence(7);
  EXPECT_NE(first_silence(8), silence);
  EXPECT_EQ(first_silence(7), silence);
}

TEST_F(BeaconTimerTest, CallsNothingBeforeItsStart) {
  timer_->set_interval(5ms);
  test::pass(io_, 1h);
  EXPECT_EQ(sent_, 0);
}

TEST_F(BeaconTimerTest, CallsNothingWithoutAnIntervalNorAfterOneIsTakenAway) {
  timer_->start();
  test::pass(io_, 1h);
  EXPECT_EQ(sent_, 0);
  timer_->set_interval(5ms);
  test::pass(io_, 5ms);
  EXPECT_EQ(sent_, 1);
  timer_->set_interval(0ms);
  test::pass(io_, 1h);
  EXPECT_EQ(sent_, 1);
}

TEST_F(BeaconTimerTest, WaitsAnewAfterEachFrame) {
  timer_->set_interval(20ms);
  timer_->start();
  for (int i = 0; i < 1000; ++i) {
    test::pass(io_, 14ms);
    timer_->silence_begins(loop::now());
  }
  EXPECT_EQ(sent_, 0);
  test::pass(io_, 20ms);
  EXPECT_EQ(sent_, 1);
}

TEST_F(BeaconTimerTest, CallsAgainWhenOneMayLeave) {
  ahead_ = 1h;
  timer_->set_interval(20ms);
  timer_->start();
  test::pass(io_, 1h + 14ms);
  EXPECT_EQ(sent_, 0);
  test::pass(io_, 6ms);
  EXPECT_EQ(sent_, 1);
}

TEST_F(BeaconTimerTest, MayBeGoneBeforeItsTime) {
  timer_->set_interval(5ms);
  timer_->start();
  timer_.reset();
  test::pass(io_, 1h);
  EXPECT_EQ(sent_, 0);
}

}  // namespace
}  // namespace swarmtalk::drivers
