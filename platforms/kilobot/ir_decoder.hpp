// Turns the times of infrared pulses into bytes and messages. Pure logic: the caller measures time
// (interrupt of a running program, polling in the bootloader) and keeps the bytes.
// Each byte is timed from its own start pulse, so clocks may differ by 5.5 %.
#pragma once

#include <stdint.h>

#include "kilobot_wire/ir_message.hpp"
#include "platforms/kilobot/ir_timing.hpp"

namespace swarmtalk {
namespace kilobot {

/// What a pulse meant.
enum class IrEvent : uint8_t {
  kBit,        // a data bit
  kByteStart,  // the start pulse of a byte: time counts from here
  kLeaderEnd,  // the stop pulse of the leading byte
  kByte,       // the stop pulse of a byte of the message: byte() and index() are valid
  kLast,       // the same for the last byte: a message, if is_intact()
  kAbort,      // no message: begin() with the next pulse
};

class IrDecoder {
 public:
  /// The first pulse of a message; time counts from it.
  void begin() {
    index_ = kLeader;
    crc_ = kIrCrcStart;
    begin_byte();
  }

  /// A further pulse.
  /// @param cycles  since the last pulse that was a byte's start, at most kIrSilenceCycles
  IrEvent on_pulse(uint16_t cycles) {
    if (expects_start_) {
      if (index_ != 0) crc_ = ir_crc_step(crc_, byte_);
      begin_byte();
      return IrEvent::kByteStart;
    }
    if (cycles < kIrHalfSlotCycles || cycles >= kIrByteEndCycles) return IrEvent::kAbort;
    while (cycles >= slot_end_) {
      slot_end_ += kIrSlotCycles;
      mask_ = static_cast<uint8_t>(mask_ << 1);
    }
    if (mask_ != 0) {
      byte_ |= mask_;
      // Light in the leading byte is a second sender.
      return index_ == kLeader ? IrEvent::kAbort : IrEvent::kBit;
    }
    expects_start_ = true;
    return end_byte();
  }

  /// Behind kLast: whether the checksum is right.
  bool is_intact() const { return ir_crc_step(crc_, byte_) == 0; }

  /// The byte just received, and its place in the message, 0 to 11.
  uint8_t byte() const { return byte_; }
  uint8_t index() const { return static_cast<uint8_t>(index_ - 1); }

 private:
  static constexpr uint8_t kLeader = 0xFF;

  void begin_byte() {
    expects_start_ = false;
    byte_ = 0;
    mask_ = 1;
    slot_end_ = kIrHalfSlotCycles + kIrSlotCycles;
  }

  IrEvent end_byte() {
    if (index_ == kLeader) {
      index_ = 0;
      return IrEvent::kLeaderEnd;
    }
    // The checksum of this byte waits for the next one's start: a stop pulse has enough to do
    // within the 269 cycles until then.
    return ++index_ == kIrMessageBytes ? IrEvent::kLast : IrEvent::kByte;
  }

  uint16_t slot_end_ = 0;
  uint16_t crc_ = 0;
  uint8_t mask_ = 0;
  uint8_t byte_ = 0;
  uint8_t index_ = 0;  // bytes of the message that are complete; kLeader in the leading byte
  bool expects_start_ = false;
};

}  // namespace kilobot
}  // namespace swarmtalk
