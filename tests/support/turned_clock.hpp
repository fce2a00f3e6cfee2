// A clock that the test turns. In a program that links turned_clock (the library) the time of
// loop/clock.hpp stands still, and every loop::Timer waits for it: nothing comes by load or chance.
#pragma once

#include <boost/asio/io_context.hpp>
#include <chrono>
#include <functional>

namespace swarmtalk::test {

/// Lets the time pass: at each instant at which a timer is due it is called, in the order of their
/// times, and `io` does what is ready then.
void pass(boost::asio::io_context& io, std::chrono::nanoseconds duration);

/// The same until `is_done`, asked when nothing is ready. @return false: it was not within `limit`
bool pass_until(boost::asio::io_context& io, const std::function<bool()>& is_done,
                std::chrono::nanoseconds limit = std::chrono::minutes(1));

}  // namespace swarmtalk::test
