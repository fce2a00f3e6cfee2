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

TEST_F(TurnedClock, SetsTheWallClockAloneAndKnowsWhatItWasBefore) {
  const auto wall = loop::wall_now();
  step_wall_clock(1h);
  step_wall_clock(-3h);
  EXPECT_EQ(loop::now(), begin_);
  EXPECT_EQ(loop::wall_now(), wall - 2h);
  EXPECT_EQ(wall_before_steps(), wall);
  pass(io_, 1s);
  EXPECT_EQ(loop::wall_now(), wall - 2h + 1s);
  EXPECT_EQ(wall_before_steps(), loop::wall_now());
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
