// The infrared message of Kilobots on the air: its numbers, its CRC, the pulses that carry it and
// the decoder that finds messages in a train of pulses. A message is one leading byte (start and
// stop pulse only; the sender listens in between) and 12 bytes (9 data, type, CRC low, CRC high),
// each a start pulse, 8 bits LSB first with a pulse for a one, and a stop pulse.
// Source: measured on kilolib's images, docs/kilobot-emulator.md, section "On the air".
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace swarmtalk::emulator {

inline constexpr std::uint64_t kIrBitNs = 33'625;      // 269 cycles at 8 MHz
inline constexpr std::uint64_t kIrPulseNs = 1'125;     // 9 cycles
inline constexpr std::uint64_t kIrSentBitNs = 33'750;  // senders take 270 cycles for a bit
inline constexpr unsigned kIrMessageBytes = 12;
inline constexpr unsigned kIrPayloadBytes = 9;

using IrMessage = std::array<std::uint8_t, kIrMessageBytes>;

/// CRC-16/MCRF4XX: reflected polynomial 0x8408, start 0xFFFF, no final XOR.
std::uint16_t ir_crc(std::span<const std::uint8_t> bytes);

/// Data (at most 9 bytes, the rest zero) and type with their CRC.
IrMessage make_ir_message(std::span<const std::uint8_t> data, std::uint8_t type);

bool has_good_crc(const IrMessage& message);

/// Start times of the pulses that carry a message, ns after the first one.
std::vector<std::uint64_t> ir_pulses(const IrMessage& message);

/// Finds messages in the rising edges of a pulse train, by the rules of a robot's receiver: every
/// byte is timed from its own start pulse, so a sender's clock may be 5.5 % off.
class FrameDecoder {
 public:
  enum class Event : std::uint8_t {
    kNone,
    kFrameStart,  // the start pulse of a leading byte
    kMessage,     // the 12th byte is complete: message() holds it, whatever its CRC says
    kBroken       // pulse where none may be (collision, noise): the frame is given up
  };

  /// @param time_ns  of the rising edge; must not fall
  Event on_pulse(std::uint64_t time_ns);

  const IrMessage& message() const { return message_; }

 private:
  Event start_frame(std::uint64_t time_ns);

  enum class State : std::uint8_t { kIdle, kInByte, kBetweenBytes };
  State state_ = State::kIdle;
  int byte_index_ = -1;  // -1: leading byte
  std::uint64_t byte_start_ns_ = 0;
  std::uint8_t value_ = 0;
  IrMessage message_{};
};

}  // namespace swarmtalk::emulator
