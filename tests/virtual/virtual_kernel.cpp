// In place of three functions of the C library, by linking. A frame that is read at the instant at
// which the clock was set came before that.
#include "tests/virtual/virtual_kernel.hpp"

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <map>

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

std::map<int, int>& refusals() {
  static std::map<int, int> errors;  // by socket
  return errors;
}

/// Why this socket does not send; sets errno. @return false: it does
bool is_refused(int socket) {
  const auto refused = refusals().find(socket);
  if (refused == refusals().end()) return false;
  errno = refused->second;
  return true;
}

}  // namespace

void refuse_frames(int socket, int error) {
  if (error == 0) {
    refusals().erase(socket);
  } else {
    refusals()[socket] = error;
  }
}

}  // namespace swarmtalk::test

// drivers::TransmitQueue calls these two.
extern "C" ssize_t sendmsg(int socket, const msghdr* message, int flags) {
  if (swarmtalk::test::is_refused(socket)) return -1;
  return ::syscall(SYS_sendmsg, socket, message, flags);
}

extern "C" int sendmmsg(int socket, mmsghdr* messages, unsigned count, int flags) {
  if (swarmtalk::test::is_refused(socket)) return -1;
  return static_cast<int>(::syscall(SYS_sendmmsg, socket, messages, count, flags));
}

// drivers::ReceiveBatch calls this one.
extern "C" int recvmmsg(int socket, mmsghdr* messages, unsigned count, int flags,
                        timespec* timeout) {
  const std::size_t room_bytes = messages[0].msg_hdr.msg_controllen;
  const long result = ::syscall(SYS_recvmmsg, socket, messages, count, flags, timeout);
  for (long i = 0; i < result; ++i) {
    swarmtalk::test::add_stamp(messages[i].msg_hdr, room_bytes);
  }
  return static_cast<int>(result);
}
