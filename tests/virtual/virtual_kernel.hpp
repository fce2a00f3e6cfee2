// What the kernel does to the frames of a virtual swarm: each has the wall clock at which it came
// as its receive stamp, and a socket may refuse to send.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace swarmtalk::test {

constexpr std::size_t kStampBytes = sizeof(std::chrono::system_clock::time_point);

/// A frame as it is given to a robot's socket: recvmmsg() takes the stamp off again.
std::vector<std::uint8_t> stamped(std::span<const std::uint8_t> frame,
                                  std::chrono::system_clock::time_point came_at);

/// From now on sending by this socket fails with this errno. 0: it does not.
void refuse_frames(int socket, int error);

}  // namespace swarmtalk::test
