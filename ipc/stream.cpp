#include "ipc/stream.hpp"

#include <sys/socket.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>

namespace swarmtalk::ipc {

int connect_stream(int fd, const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) return ENAMETOOLONG;
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  int result = 0;
  do {
    result = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  } while (result < 0 && errno == EINTR);
  return result == 0 ? 0 : errno;
}

ssize_t read_stream(int fd, std::span<std::uint8_t> room) {
  ssize_t count = 0;
  do {
    count = ::recv(fd, room.data(), room.size(), MSG_DONTWAIT);
  } while (count < 0 && errno == EINTR);
  return count;
}

ssize_t write_stream(int fd, std::string_view bytes) {
  ssize_t count = 0;
  do {
    count = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  } while (count < 0 && errno == EINTR);
  return count;
}

}  // namespace swarmtalk::ipc
