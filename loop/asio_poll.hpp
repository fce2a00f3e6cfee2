// The descriptor on which an io_context waits. Asio does not show it, so that a loop around it
// could only look again and again whether a timer has expired. Used by Loop.
#pragma once

#include <boost/asio/io_context.hpp>

namespace swarmtalk::loop {

/// Readable when io.poll() would find something that the kernel has reported: a timer, a signal, a
/// descriptor. Not for handlers that were posted. Owned by the io_context.
int poll_descriptor(boost::asio::io_context& io);

}  // namespace swarmtalk::loop
