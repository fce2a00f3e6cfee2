// "KGU1": frames that a gateway Kilobot (or our overhead controller) sends to the host over its
// serial port, 38400 8N1. A frame is COBS( payload || CRC-16 of it, little-endian ) and a 0x00;
// the CRC is the infrared one (MCRF4XX). Numbers are little-endian. Empty frames mean nothing.
// Portable, C++14, no memory of its own beyond one frame.
#pragma once

#include <stdint.h>

#include "kilobot_wire/ir_message.hpp"

namespace swarmtalk {
namespace kilobot_bridge {

enum class GatewayKind : uint8_t {
  kReception = 0x01,  // 19 bytes: kind, seq, ticks u16, data[9], type, low u16, high u16, mm u8
  kHello = 0x02,      // 12 bytes: kind, seq, ticks u16, uid u16, version, dropped u16, battery u16,
                      // flags
  kText = 0x03,       // kind, seq, up to 60 bytes of UTF-8
  kVersion = 0x04,  // 7 bytes: kind, seq, product, version, frame types u16 (bit n: type n), flags
};

constexpr uint8_t kGatewayProtocolVersion = 1;
constexpr uint8_t kGatewayNoDistance = 0xFF;
constexpr uint8_t kReceptionBytes = 19;
constexpr uint8_t kHelloBytes = 12;
constexpr uint8_t kVersionBytes = 7;
constexpr uint8_t kTextBytes = 60;
constexpr uint8_t kGatewayPayloadMax = 2 + kTextBytes;
/// COBS adds a byte (payloads are shorter than 254), the checksum two, the end one.
constexpr uint8_t kGatewayFrameMax = kGatewayPayloadMax + 4;

/// Products in a version report.
constexpr uint8_t kProductOverhead = 1;
/// Flags in a version report: serial bytes are heard while infrared is sent.
constexpr uint8_t kHearsWhileSending = 1;
/// A repetition ends without its host (kOverheadCopies).
constexpr uint8_t kEndsByItself = 2;

/// Builds one frame, byte by byte, COBS included: append the payload, then end().
class GatewayFrame {
 public:
  void begin(GatewayKind kind, uint8_t sequence) {
    size_ = 1;
    block_ = 0;
    crc_ = kilobot::kIrCrcStart;
    append(static_cast<uint8_t>(kind));
    append(sequence);
  }

  /// At most kGatewayPayloadMax bytes of payload; more are left out.
  void append(uint8_t byte) {
    if (size_ > kGatewayPayloadMax) return;
    crc_ = kilobot::ir_crc_step(crc_, byte);
    put(byte);
  }
  void append16(uint16_t number) {
    append(static_cast<uint8_t>(number));
    append(static_cast<uint8_t>(number >> 8));
  }

  void end() {
    const uint16_t crc = crc_;
    put(static_cast<uint8_t>(crc));
    put(static_cast<uint8_t>(crc >> 8));
    bytes_[block_] = static_cast<uint8_t>(size_ - block_);
    bytes_[size_++] = 0;
  }

  /// The wire bytes, after end().
  uint8_t size() const { return size_; }
  uint8_t byte(uint8_t index) const { return bytes_[index]; }

 private:
  /// COBS: a zero becomes the distance to the next one, written where the last one was.
  void put(uint8_t byte) {
    if (byte != 0) {
      bytes_[size_++] = byte;
      return;
    }
    bytes_[block_] = static_cast<uint8_t>(size_ - block_);
    block_ = size_++;
  }

  uint8_t bytes_[kGatewayFrameMax];
  uint8_t size_ = 0;
  uint8_t block_ = 0;  // where the count of the current COBS block goes
  uint16_t crc_ = 0;
};

}  // namespace kilobot_bridge
}  // namespace swarmtalk
