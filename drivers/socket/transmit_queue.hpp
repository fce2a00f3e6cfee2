// TransmitQueue: frames that are built and not yet taken by the kernel, sent many in one system
// call. A frame leaves the queue when the kernel has it, or by an explicit drop: never silently.
// Used by SocketLink.
#pragma once

#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "drivers/link/link.hpp"
#include "drivers/link/link_counters.hpp"

namespace swarmtalk::drivers {

class TransmitQueue {
 public:
  static constexpr std::size_t kFrames = 64;

  /// Put in front of each frame pushed from now on (Ethernet header). At most 14 bytes.
  void set_medium_header(std::span<const std::uint8_t> header);

  /// Where frames go, on a socket that is not bound to one place.
  void set_destination(const sockaddr_in& destination) { destination_ = destination; }

  bool is_empty() const { return first_ == end_; }
  bool is_full() const { return end_ == kFrames; }

  /// Buffer for the next frame, `buffer_bytes` long. Not when full.
  std::span<std::uint8_t> slot(std::size_t buffer_bytes);

  /// The slot holds a frame.
  void push(std::size_t frame_bytes, std::size_t packets, MonotonicTime built_at);

  /// Hands frames to the kernel, oldest first, and counts those that it took.
  /// @return 0: the queue is empty; else the errno that stopped it: the first frame is still there
  int send(int socket, LinkCounters& counters);

  std::size_t first_packets() const { return frames_[first_].packets; }
  void drop_first();

  /// Drops frames built before `oldest`. @return how many
  std::size_t drop_built_before(MonotonicTime oldest);

 private:
  static constexpr std::size_t kHeadroomBytes = 14;

  int send_some(int socket);

  struct QueuedFrame {
    std::vector<std::uint8_t> bytes;  // headroom, frame, slack; grows to the largest ever needed
    std::size_t size_bytes = 0;       // of the frame
    std::size_t packets = 0;
    MonotonicTime built_at{};
  };

  std::array<QueuedFrame, kFrames> frames_;  // those waiting are [first_, end_)
  std::size_t first_ = 0;
  std::size_t end_ = 0;
  std::array<std::uint8_t, kHeadroomBytes> medium_header_{};
  std::size_t medium_header_bytes_ = 0;
  sockaddr_in destination_{};  // sin_family 0: the socket is bound
  std::array<iovec, kFrames> parts_{};
  std::array<mmsghdr, kFrames> messages_{};
};

}  // namespace swarmtalk::drivers
