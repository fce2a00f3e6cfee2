#include "loop/asio_poll.hpp"

#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <cerrno>
#include <system_error>

namespace swarmtalk::loop {
namespace {

constexpr long kMostDescriptors = 65536;  // that are looked at: the limit may be a thousand million

}  // namespace

int opened(int descriptor) {
  if (descriptor < 0) throw std::system_error(errno, std::system_category(), "no event loop");
  return descriptor;
}

int poll_descriptor(boost::asio::io_context& io) {
  boost::asio::posix::stream_descriptor mark(io);  // has io open what it waits on
  mark.assign(opened(eventfd(0, EFD_CLOEXEC)));
  epoll_event none{};
  const long end = std::min(sysconf(_SC_OPEN_MAX), kMostDescriptors);
  // Refused by all that are no epoll or watch something else: nobody's events change.
  for (int each = 0; each < end; ++each) {
    if (epoll_ctl(each, EPOLL_CTL_MOD, mark.native_handle(), &none) == 0) return each;
  }
  throw std::system_error(EBADF, std::system_category(), "no event loop");
}

}  // namespace swarmtalk::loop
