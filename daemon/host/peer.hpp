// Who is at the other end of a Unix socket, as the kernel says.
#pragma once

#include <cstdint>
#include <string>

namespace swarmtalk::daemon {

/// "pid 123, uid 1000", as of when it connected; "unknown peer" if the kernel does not tell.
std::string peer_of(int descriptor);

/// Its user; UINT32_MAX, which is nobody's, if the kernel does not tell.
std::uint32_t uid_of(int descriptor);

}  // namespace swarmtalk::daemon
