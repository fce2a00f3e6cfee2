// What a node needs from its platform: the paper's clock and random, as two plain functions.
// Filled in once by whoever owns the node; called on the thread that calls the node.
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace core {

/// The two functions that a platform gives to a node; the other two of a port are calls into it
/// (Swarmtalk::pull_packet, Swarmtalk::on_packet). Source: Zhang et al., AAMAS 2020, sec. 3.
struct Port {
  /// Ticks since any moment, counting up, wrapping at 2^32 whatever P::kClockBits is. The tick is
  /// the profile's, so all robots that hear each other use one tick length (Kilobot 32.768 ms,
  /// Wi-Fi 1 us).
  uint32_t (*clock)(void* context);
  /// Uniform random bits, all 32 used. Called for a node id, for the first message number and, in
  /// profiles with buckets and wide message numbers, for the secret of their table, so it need not
  /// be fast; it must differ from robot to robot, or equal robots draw equal ids.
  uint32_t (*random)(void* context);
  void* context;
};

}  // namespace core
}  // namespace swarmtalk
