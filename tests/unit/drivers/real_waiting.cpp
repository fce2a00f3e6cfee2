// Waiting in tests that need the kernel's time.
#include "tests/support/patience.hpp"
#include "tests/unit/drivers/test_link_user.hpp"

namespace swarmtalk::drivers {

bool run_until(boost::asio::io_context& io, const std::function<bool()>& is_done) {
  const auto deadline = std::chrono::steady_clock::now() + test::kPatience;
  while (!is_done() && std::chrono::steady_clock::now() < deadline) {
    io.restart();
    io.run_one_for(std::chrono::milliseconds(5));
  }
  return is_done();
}

void run_for(boost::asio::io_context& io, std::chrono::milliseconds duration) {
  io.restart();
  io.run_for(duration);
}

}  // namespace swarmtalk::drivers
