// Loss: messages of a channel that did not arrive, by the place where they were lost. Plain sums;
// passed from the hub, which finds gaps, through a subscription's queue to the client.
#pragma once

#include <cstdint>

namespace swarmtalk::daemon {

struct Loss {
  std::uint64_t air = 0;     // gaps in a sender's message numbers that nothing else explains
  std::uint64_t kernel = 0;  // of such gaps: at most what the kernel dropped meanwhile
  std::uint64_t daemon = 0;  // for want of memory, by a full queue, by an age limit
  std::uint64_t late = 0;    // counted as air or kernel before, came after all

  Loss& operator+=(const Loss& other) {
    air += other.air;
    kernel += other.kernel;
    daemon += other.daemon;
    late += other.late;
    return *this;
  }
  bool operator==(const Loss&) const = default;
};

/// What a station has dropped since it was opened, up to one message: where a gap may come from.
struct DropTotals {
  std::uint64_t kernel = 0;  // frames that its socket's buffer had no room for
  std::uint64_t node = 0;    // messages given up for want of memory to put packets together
};

}  // namespace swarmtalk::daemon
