// Bare packet sockets against the raw_l2 link, in interleaved pairs of runs on one veth pair.
#pragma once

#include <chrono>
#include <cstddef>

namespace swarmtalk::l2_floor {

struct CompareConfig {
  std::size_t pairs = 5;
  std::size_t message_bytes = 64;
  std::size_t paced_messages = 1000;
  std::chrono::microseconds gap{500};  // between paced messages
  std::size_t window_messages = 100000;
  std::size_t window = 256;  // messages on their way in the loss-free phase
};

/// Prints one JSON line for each kind of ends, with medians over the runs, and one with the ratios.
/// @return exit code: 1 when messages were lost
int compare(const CompareConfig& config);

}  // namespace swarmtalk::l2_floor
