#include "tests/unit/loop/waits.hpp"

namespace swarmtalk::loop {

void run_all_waits(boost::asio::io_context& io) {
  io.restart();
  io.run();
}

}  // namespace swarmtalk::loop
