// Who is called by a timer, when, and who no more: of the product's, and of that on a clock which
// tests turn.
#include "loop/timer.hpp"

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <memory>
#include <optional>

#include "loop/clock.hpp"
#include "tests/unit/loop/waits.hpp"

namespace swarmtalk::loop {
namespace {

using namespace std::chrono_literals;

class TimerTest : public testing::Test {
 protected:
  void run() { run_all_waits(io_); }

  boost::asio::io_context io_;
  int calls_ = 0;
  std::optional<Timer> timer_{std::in_place, io_, [this] { ++calls_; }};
};

TEST_F(TimerTest, CallsOncePerWaitAndNotBeforeItsTime) {
  const Timer::Time due = now() + 5ms;
  timer_->at(due);
  EXPECT_TRUE(timer_->is_armed());
  run();
  EXPECT_EQ(calls_, 1);
  EXPECT_GE(now(), due);
  EXPECT_FALSE(timer_->is_armed());
  timer_->after(0ms);
  run();
  EXPECT_EQ(calls_, 2);
}

TEST_F(TimerTest, ALaterWaitTakesThePlaceOfTheOneBefore) {
  timer_->after(1h);
  timer_->after(1ms);
  run();
  EXPECT_EQ(calls_, 1);
}

TEST_F(TimerTest, CallsNobodyAfterCancel) {
  timer_->after(1ms);
  timer_->cancel();
  EXPECT_FALSE(timer_->is_armed());
  run();
  EXPECT_EQ(calls_, 0);
}

// Both are due in one turn, in which the first takes away or renews the second.
TEST_F(TimerTest, CallsNobodyWhoseWaitIsOverAndTakenBack) {
  Timer first(io_, [this] { timer_->cancel(); });
  first.at(now() - 2ms);
  timer_->at(now() - 1ms);
  run();
  EXPECT_EQ(calls_, 0);
}

TEST_F(TimerTest, CallsOnceForAWaitThatIsOverAndBegunAgain) {
  Timer first(io_, [this] { timer_->after(1ms); });
  first.at(now() - 2ms);
  timer_->at(now() - 1ms);
  run();
  EXPECT_EQ(calls_, 1);
}

TEST_F(TimerTest, CallsNobodyWhoIsGone) {
  Timer first(io_, [this] { timer_.reset(); });
  first.at(now() - 2ms);
  timer_->at(now() - 1ms);
  run();
  EXPECT_EQ(calls_, 0);
}

TEST_F(TimerTest, MayEndOrBeginItselfInItsOwnCall) {
  timer_.emplace(io_, [this, kept = std::make_shared<int>(7)] {
    if (++calls_ < 3) return timer_->after(0ms);
    timer_.reset();
    calls_ += *kept;  // what it holds lives until it returns
  });
  timer_->after(0ms);
  run();
  EXPECT_EQ(calls_, 10);
}

}  // namespace
}  // namespace swarmtalk::loop
