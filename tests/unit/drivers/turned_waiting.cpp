// Waiting in tests on a clock that they turn.
#include "tests/support/turned_clock.hpp"
#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {

bool run_until(boost::asio::io_context& io, const std::function<bool()>& is_done) {
  return test::pass_until(io, is_done);
}

void run_for(boost::asio::io_context& io, std::chrono::milliseconds duration) {
  test::pass(io, duration);
}

}  // namespace swarmtalk::drivers
