// Running until no timer waits any more.
#pragma once

#include <boost/asio/io_context.hpp>

namespace swarmtalk::loop {

void run_all_waits(boost::asio::io_context& io);

}  // namespace swarmtalk::loop
