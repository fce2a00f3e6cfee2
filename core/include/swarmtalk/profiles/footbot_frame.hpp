// The ten bytes of a foot-bot's range-and-bearing board: one link byte and a packet of up to nine.
// The board repeats its bytes to everybody in range on every step until they change, so the link
// byte tells new from old, and how long the packet is. Used by foot-bot drivers, on their thread.
// docs/wire-format.md draws it.
#pragma once

#include <stdint.h>
#include <string.h>

#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk {
namespace core {

struct FootbotFrame {
  static constexpr uint8_t kBytes = 10;
  static constexpr uint8_t kNew = 0x80;         // set in the one step in which the packet is sent
  static constexpr uint8_t kLengthMask = 0x0F;  // bytes of the packet; 0: none

  /// Fills the board's bytes for the coming step: the node's next packet, else zeros. Call it once
  /// in every step, so that no packet is on the board for two.
  /// @param bytes  kBytes
  /// @return whether a packet leaves
  static bool fill(Swarmtalk<Footbot>& node, uint8_t* bytes) {
    memset(bytes, 0, kBytes);
    const uint16_t size = node.pull_packet(bytes + 1);
    if (size != 0) bytes[0] = static_cast<uint8_t>(kNew | size);
    return size != 0;
  }

  /// Hands the packet in another board's bytes to the node, if there is a new one.
  /// @return kOk, also for none; else on_packet's, which refuses a length above 9 before it reads a
  /// byte
  static Error read(Swarmtalk<Footbot>& node, const uint8_t* bytes,
                    const RangeBearingSensing& sensing) {
    if ((bytes[0] & kNew) == 0) return Error::kOk;
    return node.on_packet(bytes + 1, bytes[0] & kLengthMask, sensing);
  }
};
static_assert(FootbotFrame::kBytes == Wire<Footbot>::kMtuBytes + 1, "a link byte and a packet");

}  // namespace core
}  // namespace swarmtalk
