#include "ipc/pass_descriptor.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <cstring>

namespace swarmtalk::ipc {
namespace {

/// A message header for one descriptor. Refers to itself: does not move.
struct Passing {
  Passing(const void* bytes, std::size_t size) : part{const_cast<void*>(bytes), size} {
    header.msg_iov = &part;
    header.msg_iovlen = 1;
    header.msg_control = control;
    header.msg_controllen = sizeof control;
  }
  Passing(const Passing&) = delete;
  Passing& operator=(const Passing&) = delete;

  iovec part;
  msghdr header{};
  alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))] = {};
};

}  // namespace

ssize_t send_with_descriptor(int socket, const void* bytes, std::size_t size, int descriptor) {
  Passing passing(bytes, size);
  cmsghdr* control = CMSG_FIRSTHDR(&passing.header);
  control->cmsg_level = SOL_SOCKET;
  control->cmsg_type = SCM_RIGHTS;
  control->cmsg_len = CMSG_LEN(sizeof descriptor);
  std::memcpy(CMSG_DATA(control), &descriptor, sizeof descriptor);
  return sendmsg(socket, &passing.header, MSG_NOSIGNAL | MSG_DONTWAIT);
}

ssize_t receive_with_descriptor(int socket, void* bytes, std::size_t size, int& descriptor) {
  Passing passing(bytes, size);
  const ssize_t got = recvmsg(socket, &passing.header, MSG_CMSG_CLOEXEC);
  const cmsghdr* control = got > 0 ? CMSG_FIRSTHDR(&passing.header) : nullptr;
  if (control != nullptr && control->cmsg_level == SOL_SOCKET && control->cmsg_type == SCM_RIGHTS &&
      control->cmsg_len == CMSG_LEN(sizeof descriptor)) {
    std::memcpy(&descriptor, CMSG_DATA(control), sizeof descriptor);
  }
  return got;
}

}  // namespace swarmtalk::ipc
