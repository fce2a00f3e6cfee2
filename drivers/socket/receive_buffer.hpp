// The kernel's receive buffer of a link's socket.
#pragma once

#include <cstddef>
#include <optional>

#include "drivers/link/link.hpp"

namespace swarmtalk::drivers {

/// Asked for where nothing is configured. The kernel may give less.
inline constexpr std::size_t kUsualReceiveBufferBytes = std::size_t{4} << 20;

/// Sets it, beyond the machine's limit where we may (CAP_NET_ADMIN), and logs when the kernel gives
/// less. @param size_bytes  none: kUsualReceiveBufferBytes
std::size_t use_receive_buffer(const Link& link, int socket, std::optional<std::size_t> size_bytes);

}  // namespace swarmtalk::drivers
