#include "drivers/socket/receive_buffer.hpp"

#include <sys/socket.h>

#include <algorithm>

#include "drivers/link/link_log.hpp"

namespace swarmtalk::drivers {
namespace {

constexpr std::size_t kLargestBufferBytes = std::size_t{1} << 30;

/// @return what the kernel gives, in bytes: less than asked where its limit is lower
std::size_t set_receive_buffer(int socket, std::size_t size_bytes) {
  const int size = static_cast<int>(std::min<std::size_t>(size_bytes, kLargestBufferBytes));
  if (setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &size, sizeof size) != 0) {
    setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &size, sizeof size);
  }
  int doubled = 0;  // for the kernel's own book-keeping, socket(7)
  socklen_t length = sizeof doubled;
  getsockopt(socket, SOL_SOCKET, SO_RCVBUF, &doubled, &length);
  return static_cast<std::size_t>(doubled) / 2;
}

}  // namespace

// Nobody who asks for nothing special has to do anything about it.
std::size_t use_receive_buffer(const Link& link, int socket,
                               std::optional<std::size_t> size_bytes) {
  const std::size_t asked = size_bytes.value_or(kUsualReceiveBufferBytes);
  const std::size_t given = set_receive_buffer(socket, asked);
  if (given >= asked) return given;
  link_log()->log(
      size_bytes ? spdlog::level::warn : spdlog::level::info,
      "{} {}: the kernel gives {} bytes of receive buffer, not the {} of receive_buffer_bytes, and "
      "drops frames (kernel_drops) when they are full; raise its limit (sysctl -w "
      "net.core.rmem_max={}) and start swarmtalkd again, or ask for less",
      link.type(), link.device(), given, asked, asked);
  return given;
}

}  // namespace swarmtalk::drivers
