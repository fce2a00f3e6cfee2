// The clock that tests turn.
#include "tests/support/turned_clock.hpp"

#include <gtest/gtest.h>

#include <boost/asio/post.hpp>
#include <string>
#include <vector>

#include "loop/clock.hpp"
#include "loop/timer.hpp"

namespace swarmtalk::test {
namespace {

using namespace std::chrono_literals;

class TurnedClock : public testing::Test {
 protected:
  loop::Timer::Time begin_ = loop::now();
  boost::asio::io_context io_;
};

TEST_F(TurnedClock, StandsStillUntilItIsTurnedAndStopsAtTheEnd) {
  const auto wall = loop::wall_now();
  EXPECT_EQ(loop::now(), begin_);
  pass(io_, 24h + 1ns);
  EXPECT_EQ(loop::now(), begin_ + 24h + 1ns);
  EXPECT_EQ(loop::wall_now() - wall, 24h + 1ns);
}

TEST_F(TurnedClock, SetsTheWallClockAloneOfAllMachinesOrOfOne) {
  const auto wall = loop::wall_now();
  boost::asio::io_context other;
  step_wall_clock(1h);
  step_wall_clock(-3h);
  step_wall_clock(5h, other);
  EXPECT_EQ(loop::now(), begin_);
  EXPECT_EQ(loop::wall_now(), wall - 2h);
  EXPECT_EQ(wall_now_of(other), wall + 3h);
  pass(io_, 1s);
  EXPECT_EQ(loop::wall_now(), wall - 2h + 1s);
  loop::Timer there(other, [&] { EXPECT_EQ(loop::wall_now(), wall + 3h + 2s); });
  loop::Timer here(io_, [&] { EXPECT_EQ(loop::wall_now(), wall - 2h + 2s); });
  there.after(1s);
  here.after(1s);
  pass(1s);
  EXPECT_FALSE(here.is_armed() || there.is_armed());
  enter(other);
  EXPECT_EQ(loop::wall_now(), wall + 3h + 2s);
  step_wall_clock(2h - 0s);
  step_wall_clock(-5h, other);
  enter(io_);
}

TEST_F(TurnedClock, HoldsTheTimersOfAMachineAndCallsThemLate) {
  boost::asio::io_context other;
  std::string told;
  loop::Timer held(other,
                   [&] { told += "held at " + std::to_string((loop::now() - begin_) / 1s); });
  loop::Timer timer(io_, [&] { told += "on time, "; });
  held.after(1s);
  timer.after(2s);
  hold_timers(other, true);
  pass(3s);
  hold_timers(other, false);
  pass(1s);
  EXPECT_EQ(told, "on time, held at 3");
}

TEST_F(TurnedClock, CallsEachAtItsTimeInOrderAndFirstWhatIsReady) {
  std::string told;
  const auto note = [&](char who) {
    boost::asio::post(io_, [&told, who] { told += static_cast<char>(who + 'a' - 'A'); });
    told += who;
  };
  loop::Timer late(io_, [&] {
    EXPECT_EQ(loop::now(), begin_ + 2s);
    note('C');
  });
  late.at(begin_ + 2s);
  loop::Timer first(io_, [&] { note('A'); });
  loop::Timer second(io_, [&] { note('B'); });
  first.at(begin_ + 1s);
  second.at(begin_ + 1s);
  pass(io_, 2s - 1ns);
  EXPECT_EQ(told, "AaBb");
  pass(io_, 1ns);
  EXPECT_EQ(told, "AaBbCc");
}

TEST_F(TurnedClock, ATimeThatIsOverIsNow) {
  int calls = 0;
  loop::Timer timer(io_, [&] { ++calls; });
  timer.at(begin_ - 1h);
  pass(io_, 0s);
  EXPECT_EQ(calls, 1);
  EXPECT_EQ(loop::now(), begin_);
}

TEST_F(TurnedClock, PassesUntilSomethingHasHappenedOrTheLimit) {
  int calls = 0;
  loop::Timer timer(io_, [&] {
    ++calls;
    timer.after(1s);
  });
  timer.after(1s);
  EXPECT_TRUE(pass_until(io_, [&] { return calls == 3; }));
  EXPECT_EQ(loop::now(), begin_ + 3s);
  EXPECT_FALSE(pass_until(
      io_, [&] { return calls == 1000; }, 10s));
  EXPECT_EQ(calls, 13);
}

}  // namespace
}  // namespace swarmtalk::test
