// In place of three functions of the C library, by linking.
#include "tests/virtual/virtual_kernel.hpp"

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <map>

namespace swarmtalk::test {
namespace {

using Stamp = std::chrono::system_clock::time_point;

/// @param room_bytes  for what the kernel adds to a datagram; REQUIRES that it added nothing
void take_stamp(mmsghdr& message, std::size_t room_bytes) {
  Stamp came_at;
  if (message.msg_len < sizeof came_at) return;  // the other end has gone
  message.msg_len -= static_cast<unsigned>(sizeof came_at);
  const auto* const bytes = static_cast<const std::uint8_t*>(message.msg_hdr.msg_iov->iov_base);
  std::memcpy(&came_at, bytes + message.msg_len, sizeof came_at);
  const std::chrono::nanoseconds wall = came_at.time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(wall);
  const timespec stamp{static_cast<time_t>(seconds.count()),
                       static_cast<long>((wall - seconds).count())};
  msghdr& header = message.msg_hdr;
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

std::vector<std::uint8_t> stamped(std::span<const std::uint8_t> frame, Stamp came_at) {
  std::vector<std::uint8_t> bytes(frame.size() + sizeof came_at);
  std::copy(frame.begin(), frame.end(), bytes.begin());
  std::memcpy(bytes.data() + frame.size(), &came_at, sizeof came_at);
  return bytes;
}

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
    swarmtalk::test::take_stamp(messages[i], room_bytes);
  }
  return static_cast<int>(result);
}
