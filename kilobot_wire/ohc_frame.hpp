// The 132-byte frames that a host sends to an overhead controller (OHC) over its serial line, as
// tests and tools need them: made from their parts, without the padding and pacing that a real host
// must add.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace swarmtalk::ohc_double {

inline constexpr std::size_t kFrameBytes = 132;
inline constexpr std::uint8_t kFrameHeader = 0x55;

enum class FrameType : std::uint8_t {
  kStop = 0,
  kLedToggle = 1,
  kForward = 2,     // repeat an infrared message until the next frame
  kForwardRaw = 3,  // the same, its CRC given
  kBootPage = 4,    // one page of a program, as 22 infrared messages
  kGps = 5,         // up to 16 positions, one infrared message each
  kSingle = 6       // an infrared message once
};

enum IrType : std::uint8_t {  // infrared message types that robots act on themselves
  kIrBoot = 0x80,
  kIrBootPage = 0x81,
  kIrBootSize = 0x82,
  kIrReset = 0x83,
  kIrSleep = 0x84,
  kIrWakeUp = 0x85,
  kIrCharge = 0x86,
  kIrVoltage = 0x87,
  kIrRun = 0x88,
  kIrReadUid = 0x89,
  kIrCalibrate = 0x8A
};

using Frame = std::array<std::uint8_t, kFrameBytes>;

/// @param payload  at most 129 bytes, the rest is zero; the last byte makes the XOR of all zero
inline Frame make_frame(std::uint8_t type, std::span<const std::uint8_t> payload = {}) {
  Frame frame{};
  frame[0] = kFrameHeader;
  frame[1] = type;
  std::copy_n(payload.begin(), std::min<std::size_t>(payload.size(), kFrameBytes - 3),
              frame.begin() + 2);
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : frame) sum = static_cast<std::uint8_t>(sum ^ byte);
  frame[kFrameBytes - 1] = sum;
  return frame;
}

inline Frame make_frame(FrameType type, std::span<const std::uint8_t> payload = {}) {
  return make_frame(static_cast<std::uint8_t>(type), payload);
}

/// A frame that carries an infrared message: kForward or kSingle.
/// @param data  at most 9 bytes, the rest is zero
inline Frame make_message_frame(FrameType type, std::uint8_t ir_type,
                                std::span<const std::uint8_t> data = {}) {
  std::array<std::uint8_t, 10> payload{};
  std::copy_n(data.begin(), std::min<std::size_t>(data.size(), 9), payload.begin());
  payload[9] = ir_type;
  return make_frame(type, payload);
}

}  // namespace swarmtalk::ohc_double
