#include "tests/support/turned_clock.hpp"
#include "tests/unit/loop/waits.hpp"

namespace swarmtalk::loop {

void run_all_waits(boost::asio::io_context& io) {
  test::pass(io, std::chrono::hours(2));
}

}  // namespace swarmtalk::loop
