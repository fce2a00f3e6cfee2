// The kernel's receive stamps in a virtual swarm: each frame has the wall clock at which it came.
// One that is read at the instant at which the clock was set came before.
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <cstring>
#include <ctime>

#include "tests/support/turned_clock.hpp"

namespace swarmtalk::test {
namespace {

timespec present_stamp() {
  const std::chrono::nanoseconds wall = wall_before_steps().time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(wall);
  return {static_cast<time_t>(seconds.count()), static_cast<long>((wall - seconds).count())};
}

/// @param room_bytes  for what the kernel adds to a datagram; REQUIRES that it added nothing
void add_stamp(msghdr& header, std::size_t room_bytes) {
  const timespec stamp = present_stamp();
  if (room_bytes < CMSG_SPACE(sizeof stamp)) return;
  header.msg_controllen = CMSG_SPACE(sizeof stamp);
  cmsghdr* const part = CMSG_FIRSTHDR(&header);
  part->cmsg_level = SOL_SOCKET;
  part->cmsg_type = SCM_TIMESTAMPNS;
  part->cmsg_len = CMSG_LEN(sizeof stamp);
  std::memcpy(CMSG_DATA(part), &stamp, sizeof stamp);
}

}  // namespace
}  // namespace swarmtalk::test

/// In place of the C library's: drivers::ReceiveBatch calls it.
extern "C" int recvmmsg(int socket, mmsghdr* messages, unsigned count, int flags,
                        timespec* timeout) {
  const std::size_t room_bytes = messages[0].msg_hdr.msg_controllen;
  const long result = ::syscall(SYS_recvmmsg, socket, messages, count, flags, timeout);
  for (long i = 0; i < result; ++i) {
    swarmtalk::test::add_stamp(messages[i].msg_hdr, room_bytes);
  }
  return static_cast<int>(result);
}
