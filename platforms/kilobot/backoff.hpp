// When a robot may try to send: random waits that starve nobody. Pure logic; times are units of
// 128 us, random numbers come from the caller.
//
// Rules. After a message of its own a robot waits for its turn: a random time around a mean, which
// grows with the number of messages heard since, so that neighbours share the air evenly. When the
// air is taken it draws a new short wait at random, like everybody else who waits: nobody keeps a
// place, so nobody can be locked out by clocks that run alike.
#pragma once

#include <stdint.h>

#include "platforms/kilobot/clock.hpp"

namespace swarmtalk {
namespace kilobot {

class Backoff {
 public:
  /// Shortest mean time between two messages of one robot, 32.8 ms. Closer, robots in the middle of
  /// a group, whose neighbours do not hear each other, get less than half of what those at its edge
  /// get; and less arrives in all.
  static constexpr uint16_t kLeastSpacing = kUnitsPerTick;
  /// Air time of one message and the gap behind it: 4.6 ms.
  static constexpr uint16_t kMessageUnits = 36;
  /// Longest wait after finding the air taken, 16 ms.
  static constexpr uint16_t kBusyUnits = 128;

  /// @param spacing  mean time between two messages of this robot, if the air is free
  void start(uint16_t now, uint16_t spacing, uint16_t noise) {
    spacing_ = spacing < kLeastSpacing ? kLeastSpacing : spacing;
    due_ = static_cast<uint16_t>(now + busy_wait(noise));
  }

  /// Whether the robot may try now.
  bool is_due(uint16_t now) const { return has_come(now, due_); }
  uint16_t due() const { return due_; }

  /// A message has left. @param heard  messages of others heard since the one before, 0 to 255
  void on_sent(uint16_t now, uint8_t heard, uint16_t noise) {
    // Half the new count, half the old: the number of neighbours shows over several turns.
    turns_ = static_cast<uint8_t>((turns_ + heard + 1) / 2);
    uint16_t mean = static_cast<uint16_t>((turns_ + 1) * kMessageUnits);
    if (mean < spacing_) mean = spacing_;
    due_ = static_cast<uint16_t>(now + mean / 2 + scaled(noise, mean));
  }

  /// The air was taken, or there was nothing to send.
  void on_deferred(uint16_t now, uint16_t noise) {
    due_ = static_cast<uint16_t>(now + 1 + busy_wait(noise));
  }

 private:
  /// Below kBusyUnits, a power of two: no multiplication.
  static uint16_t busy_wait(uint16_t noise) {
    return static_cast<uint16_t>(noise / (UINT32_C(0x10000) / kBusyUnits));
  }

  static uint16_t scaled(uint16_t noise, uint16_t limit) {
    return static_cast<uint16_t>((static_cast<uint32_t>(noise) * limit) >> 16);
  }

  uint16_t due_ = 0;
  uint16_t spacing_ = 0;
  uint8_t turns_ = 0;
};

}  // namespace kilobot
}  // namespace swarmtalk
