#include "loop/asio_poll.hpp"

#include <boost/asio/detail/epoll_reactor.hpp>

namespace swarmtalk::loop {
namespace {

using Reactor = boost::asio::detail::epoll_reactor;

// The names in an explicit instantiation are not subject to access control ([temp.spec]): the one
// way to a member that has no function.
struct EpollDescriptor {
  using Member = int Reactor::*;
  friend Member member_of(EpollDescriptor);
};
template <typename Tag, typename Tag::Member kMember>
struct Opened {
  friend typename Tag::Member member_of(Tag) { return kMember; }
};
template struct Opened<EpollDescriptor, &Reactor::epoll_fd_>;

}  // namespace

int poll_descriptor(boost::asio::io_context& io) {
  Reactor& reactor = boost::asio::use_service<Reactor>(io);
  reactor.init_task();  // io.poll() looks at it from now on
  return reactor.*member_of(EpollDescriptor{});
}

}  // namespace swarmtalk::loop
