// When a silent link is told to send a beacon.
#include "drivers/link/beacon_timer.hpp"

#include <gtest/gtest.h>

#include <boost/asio/steady_timer.hpp>
#include <optional>

#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {
namespace {

using namespace std::chrono_literals;

class BeaconTimerTest : public testing::Test {
 protected:
  boost::asio::io_context io_;
  int sent_ = 0;
  std::optional<BeaconTimer> timer_{std::in_place, io_, [this](Beacon::Time) { ++sent_; }};
};

TEST_F(BeaconTimerTest, CallsAgainAndAgainWhileTheLinkIsSilent) {
  timer_->set_interval(20ms);
  timer_->start();
  EXPECT_TRUE(run_until(io_, [&] { return sent_ >= 3; }));
}

TEST_F(BeaconTimerTest, CallsNothingBeforeItsStart) {
  timer_->set_interval(5ms);
  run_for(io_, 30ms);
  EXPECT_EQ(sent_, 0);
}

TEST_F(BeaconTimerTest, CallsNothingWithoutAnIntervalNorAfterOneIsTakenAway) {
  timer_->start();
  run_for(io_, 20ms);
  EXPECT_EQ(sent_, 0);
  timer_->set_interval(5ms);
  EXPECT_TRUE(run_until(io_, [&] { return sent_ >= 1; }));
  timer_->set_interval(0ms);
  sent_ = 0;
  run_for(io_, 30ms);
  EXPECT_EQ(sent_, 0);
}

TEST_F(BeaconTimerTest, CallsNothingIfTheIntervalIsTakenAwayInTheInstantInWhichOneIsDue) {
  boost::asio::steady_timer before(io_, std::chrono::steady_clock::now());
  before.async_wait([this](const boost::system::error_code&) { timer_->set_interval(0ms); });
  timer_->set_interval(1ms);
  timer_->start();
  boost::asio::steady_timer(io_, 5ms).wait();  // both are due
  run_for(io_, 20ms);
  EXPECT_EQ(sent_, 0);
}

TEST_F(BeaconTimerTest, WaitsAnewAfterEachFrame) {
  timer_->set_interval(20ms);
  timer_->start();
  timer_->silence_begins(std::chrono::steady_clock::now() + 1h);
  run_for(io_, 60ms);
  EXPECT_EQ(sent_, 0);
}

TEST_F(BeaconTimerTest, MayBeGoneBeforeItsTime) {
  timer_->set_interval(5ms);
  timer_->start();
  timer_.reset();
  run_for(io_, 20ms);
  EXPECT_EQ(sent_, 0);
}

}  // namespace
}  // namespace swarmtalk::drivers
