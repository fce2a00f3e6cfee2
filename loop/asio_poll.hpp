// The descriptor on which an io_context waits. Asio does not show it, so that a loop around it
// could only look again and again whether a timer has expired; the kernel knows which of our
// descriptors watches one that Asio was given. Used by Loop.
#pragma once

#include <boost/asio/io_context.hpp>

namespace swarmtalk::loop {

/// What was just opened. @throws std::system_error  -1, with what errno says
int opened(int descriptor);

/// Readable when io.poll() would find something that the kernel has reported: a timer, a signal, a
/// descriptor. Not for handlers that were posted. Owned by the io_context.
/// @throws std::system_error  no descriptor is left
int poll_descriptor(boost::asio::io_context& io);

}  // namespace swarmtalk::loop
