// When a robot may try to send: turns in slots that robots find among themselves, those included
// that it cannot hear. Pure logic; times are units of 128 us, random numbers come from the caller.
//
// A robot has one turn in each period and keeps it. Turns begin on the beat of slots that
// hold one message; each message heard moves the next turn a little towards its sender's beat, so
// clocks that differ do not slide through each other. Where the air is taken the robot moves on by
// some slots. Two robots that do not hear each other may still have the same slot, and a third one
// between them hears neither: it tells with its next message how long ago it heard what it could
// not read (kIrReports), and who has sent at that time moves to another slot, or stays, at random.
#pragma once

#include <stdint.h>

#include "kilobot_wire/ir_message.hpp"
#include "platforms/kilobot/clock.hpp"

namespace swarmtalk {
namespace kilobot {

class Turns {
 public:
  /// A message and the gap behind it: 5.1 ms.
  static constexpr uint8_t kSlotUnits = 40;
  /// From a message's first pulse until the main loop has it.
  static constexpr uint8_t kMessageUnits = 35;

  void start(uint16_t now) { due_ = now; }

  /// Whether the robot may try now.
  bool is_due(uint16_t now) const { return has_come(now, due_); }
  uint16_t due() const { return due_; }

  /// The turn is taken, or is not needed. @param period  until the next, in whole slots
  void on_turn(uint16_t begun, uint16_t period) {
    begun_ = begun;
    do {  // on the beat, even if this one was late; those that were missed are lost
      due_ = static_cast<uint16_t>(due_ + period);
    } while (has_come(begun, due_));
  }

  /// To another slot, one to 16 later.
  void move(uint16_t noise) {
    due_ = static_cast<uint16_t>(due_ + static_cast<uint8_t>((noise & 15) + 1) * kSlotUnits);
  }

  /// A message was heard: its sender's beat draws the next turn a little towards it.
  /// @param begun  its first pulse
  /// @return whether it reports that this robot's last message met another: move
  bool on_heard(uint16_t begun, uint8_t type) {
    uint16_t late = static_cast<uint16_t>(due_ - begun);
    while (late >= kSlotUnits) late = static_cast<uint16_t>(late - kSlotUnits);
    uint8_t half = static_cast<uint8_t>(static_cast<uint8_t>(late + 1) / 2);
    if (half > kSlotUnits / 4) half = static_cast<uint8_t>(half - kSlotUnits / 2);
    due_ = static_cast<uint16_t>(due_ - static_cast<int8_t>(half));
    const uint8_t age = static_cast<uint8_t>(type - kIrReports);
    if (age > kIrMostReport) return false;
    const uint16_t since = static_cast<uint16_t>(begun - age * kIrReportUnits - begun_);
    if (static_cast<uint16_t>(since - kNoticedUnits) >= kMessageUnits + kIrReportUnits)
      return false;
    // Half of those who are meant stay where they are, or all would meet again elsewhere.
    begun_ = begun;  // no second time for the same message
    return (begun & 1) != 0;
  }

  /// Something was heard that cannot be read.
  void on_garbled(uint16_t now) {
    if (has_garbled_) return;  // the first since the last report
    garbled_ = now;
    has_garbled_ = true;
  }

  /// The type of a SwarmTalk message that begins now: it reports once.
  uint8_t type(uint16_t now) {
    const uint16_t age = static_cast<uint16_t>(now - garbled_);
    const bool has_news = has_garbled_ && age < (kIrMostReport + 1) * kIrReportUnits;
    has_garbled_ = false;
    if (!has_news) return kIrSwarmtalk;
    return static_cast<uint8_t>(kIrReports + age / kIrReportUnits);
  }

 private:
  /// A report rounds down, and what is garbled shows a little later than it begins.
  static constexpr uint8_t kNoticedUnits = 4;

  uint16_t due_ = 0;
  uint16_t begun_ = 0;    // the last own turn
  uint16_t garbled_ = 0;  // when, if it was
  bool has_garbled_ = false;
};

}  // namespace kilobot
}  // namespace swarmtalk
