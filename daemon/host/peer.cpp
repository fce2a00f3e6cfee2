#include "daemon/host/peer.hpp"

#include <sys/socket.h>

namespace swarmtalk::daemon {

std::string peer_of(int descriptor) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return "unknown peer";
  return "pid " + std::to_string(peer.pid) + ", uid " + std::to_string(peer.uid);
}

std::uint32_t uid_of(int descriptor) {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return UINT32_MAX;
  return peer.uid;
}

}  // namespace swarmtalk::daemon
