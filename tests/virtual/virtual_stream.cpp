// ipc/stream.hpp in a virtual swarm: a program reaches the daemon of its robot in this process.
#include <sys/socket.h>

#include <cerrno>

#include "ipc/stream.hpp"
#include "tests/virtual/swarm.hpp"

namespace swarmtalk::ipc {

int connect_stream(int fd, const std::string& path) {
  return test::Swarm::present() == nullptr ? ENOENT : test::Swarm::present()->connect(fd, path);
}

ssize_t read_stream(int fd, std::span<std::uint8_t> room) {
  return ::recv(fd, room.data(), test::Swarm::present()->piece_of(room.size()), MSG_DONTWAIT);
}

ssize_t write_stream(int fd, std::string_view bytes) {
  return ::send(fd, bytes.data(), test::Swarm::present()->piece_of(bytes.size()),
                MSG_NOSIGNAL | MSG_DONTWAIT);
}

}  // namespace swarmtalk::ipc
