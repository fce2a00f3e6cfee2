// A clock that the test turns, and chance that it seeds. In a program that links turned_clock (the
// library) the time of loop/clock.hpp stands still, every loop::Timer waits for it, and what
// loop/chance.hpp draws is the same each time: nothing comes by load or luck.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>

namespace swarmtalk::test {

/// The time is at its beginning again, and loop/chance.hpp draws by this seed. The program begins
/// so with 1. REQUIRES that nothing waits
void begin(std::uint64_t seed);

/// Sets the wall clock, loop::wall_now(), forward or back by a step.
void step_wall_clock(std::chrono::nanoseconds step);

/// The wall clock as it was before the steps of this instant, as in stamps that were taken then.
std::chrono::system_clock::time_point wall_before_steps();

/// Lets the time pass: at each instant at which a timer is due it is called, in the order of their
/// times, and `io` does what is ready then.
void pass(boost::asio::io_context& io, std::chrono::nanoseconds duration);

/// The same where nothing has a loop.
void pass(std::chrono::nanoseconds duration);

/// The same until `is_done`, asked when nothing is ready. @return false: it was not within `limit`
bool pass_until(boost::asio::io_context& io, const std::function<bool()>& is_done,
                std::chrono::nanoseconds limit = std::chrono::minutes(1));

}  // namespace swarmtalk::test
