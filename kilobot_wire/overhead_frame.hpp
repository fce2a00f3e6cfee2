// Frames that a host sends to the Kilobots' overhead controller: always 132 bytes, 38400 8N1, no
// answer (but see kVersion). Portable, C++14: used by the controller's firmware and by hosts.
//
//   0     0x55
//   1     OverheadType
//   2     payload, 129 bytes, unused ones 0
//   131   XOR of bytes 0 to 130
#pragma once

#include <stdint.h>

namespace swarmtalk {
namespace kilobot_bridge {

constexpr uint8_t kOverheadFrameBytes = 132;
constexpr uint8_t kOverheadHeader = 0x55;
constexpr uint8_t kOverheadPayload = 2;   // offset of the payload
constexpr uint8_t kOverheadPageData = 3;  // offset of a program page's bytes, behind its number
/// kForward, kForwardRaw: how many copies are sent at most, uint16 little-endian, and behind it the
/// same with all bits turned over. Anything else, as from hosts that know nothing of it, means
/// kMostCopies. Only our controller reads it; the stock one goes on for ever.
constexpr uint8_t kOverheadCopies = 14;
/// 30 s: more than it takes to wake robots that sleep.
constexpr uint16_t kMostCopies = 2885;
constexpr uint16_t kCopyMicroseconds = 10400;
constexpr uint8_t kProgramPageBytes = 128;
constexpr uint8_t kProgramPages = 220;  // beyond lies the bootloader
constexpr uint8_t kGpsRecordBytes = 8;  // id u16, x i16, y i16 (little-endian), theta i8, 0
constexpr uint8_t kGpsRecords = 16;

enum class OverheadType : uint8_t {
  kStop = 0,           // stop repeating
  kLedToggle = 1,      // toggle the controller's own LED
  kForward = 2,        // [2..10] data, [11] type: repeat this infrared message until the next frame
  kForwardRaw = 3,     // the same with the checksum in [12..13], little-endian, right or wrong
  kPage = 4,           // [2] page number, [3..130] its bytes: send once, as 22 messages
  kGps = 5,            // up to 16 records: send each once; an all-zero record ends the list
  kForwardSingle = 6,  // as kForward, once
  kVersion = 7,        // answer with a version report (gateway_frame.hpp); others ignore it
};

/// Finds frames in the byte stream as the controllers do: a frame is any 132 bytes that begin with
/// the header and whose XOR is 0. There is no resynchronisation, and none is needed. A frame stays
/// readable while at most kLag further bytes arrive. Cost per byte is constant.
class OverheadFrameFinder {
 public:
  static constexpr uint8_t kLag = 256 - kOverheadFrameBytes;

  /// @return whether `byte` completes a frame; frame_byte() then reads it
  bool on_byte(uint8_t byte) {
    sum_ ^= byte;
    sum_ ^= ring_[static_cast<uint8_t>(end_ - kOverheadFrameBytes)];
    ring_[end_++] = byte;
    const uint8_t begin = static_cast<uint8_t>(end_ - kOverheadFrameBytes);
    if (sum_ != 0 || ring_[begin] != kOverheadHeader) return false;
    frame_ = begin;
    return true;
  }

  /// Byte `offset` (0 to 131) of the last frame found.
  uint8_t frame_byte(uint8_t offset) const { return ring_[static_cast<uint8_t>(frame_ + offset)]; }

 private:
  uint8_t ring_[256] = {};
  uint8_t end_ = 0;    // where the next byte goes
  uint8_t frame_ = 0;  // where the last frame begins
  uint8_t sum_ = 0;    // XOR of the last 132 bytes
};

}  // namespace kilobot_bridge
}  // namespace swarmtalk
