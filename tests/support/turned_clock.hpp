// A clock that the test turns, and chance that it seeds. In a program that links turned_clock (the
// library) the time of loop/clock.hpp stands still, every loop::Timer waits for it, and what
// loop/chance.hpp draws is the same each time: nothing comes by load or luck. Of several machines
// in one program each has an io_context; they share the clock, and each has a wall clock of its
// own.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <cstdint>
#include <functional>

namespace swarmtalk::test {

/// The time is at its beginning again, and loop/chance.hpp draws by this seed. The program begins
/// so with 1. REQUIRES that nothing waits
void begin(std::uint64_t seed);

/// What runs from now on is of the machine of this io_context: a timer's call is by itself.
void enter(const boost::asio::io_context& io);
/// Null: none has been entered.
const boost::asio::io_context* entered_machine();

/// Sets the wall clock of all machines, loop::wall_now(), forward or back by a step.
void step_wall_clock(std::chrono::nanoseconds step);
/// That of this machine.
void step_wall_clock(std::chrono::nanoseconds step, const boost::asio::io_context& io);
std::chrono::system_clock::time_point wall_now_of(const boost::asio::io_context& io);

/// Whether the timers of this machine wait, however late it is.
void hold_timers(const boost::asio::io_context& io, bool are_held);

/// How many timers of this machine have been called, since begin().
std::uint64_t calls_of(const boost::asio::io_context& io);

/// Lets the time pass: at each instant at which a timer is due it is called, in the order of their
/// times, and `io` does what is ready then.
void pass(boost::asio::io_context& io, std::chrono::nanoseconds duration);

/// The same of several machines. @param run_ready  what is ready, of all of them, without waiting;
///   @return false: nothing was
void pass(const std::function<bool()>& run_ready, std::chrono::nanoseconds duration);

/// The same where nothing has a loop.
void pass(std::chrono::nanoseconds duration);

/// The same until `is_done`, asked when nothing is ready. @return false: it was not within `limit`
bool pass_until(boost::asio::io_context& io, const std::function<bool()>& is_done,
                std::chrono::nanoseconds limit = std::chrono::minutes(1));
bool pass_until(const std::function<bool()>& run_ready, const std::function<bool()>& is_done,
                std::chrono::nanoseconds limit);

}  // namespace swarmtalk::test
