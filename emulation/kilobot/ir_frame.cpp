#include "emulation/kilobot/ir_frame.hpp"

#include <algorithm>

#include "kilobot_wire/ir_message.hpp"

namespace swarmtalk::emulator {

std::uint16_t ir_crc(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = kilobot::kIrCrcStart;
  for (const std::uint8_t byte : bytes) crc = kilobot::ir_crc_step(crc, byte);
  return crc;
}

IrMessage make_ir_message(std::span<const std::uint8_t> data, std::uint8_t type) {
  IrMessage message{};
  std::copy_n(data.begin(), std::min<std::size_t>(data.size(), kIrPayloadBytes), message.begin());
  message[9] = type;
  const std::uint16_t crc = ir_crc(std::span(message).first(10));
  message[10] = static_cast<std::uint8_t>(crc);
  message[11] = static_cast<std::uint8_t>(crc >> 8);
  return message;
}

bool has_good_crc(const IrMessage& message) {
  return ir_crc(std::span(message).first(10)) == message[10] + message[11] * 256u;
}

std::vector<std::uint64_t> ir_pulses(const IrMessage& message) {
  // The leading byte's stop pulse comes 2420 cycles after its start, the first byte 286 later;
  // every byte takes 9 bits from start to stop and the next start comes 282 cycles after that.
  constexpr std::uint64_t kCycleNs = 125;
  std::vector<std::uint64_t> pulses{0, 2420 * kCycleNs};
  std::uint64_t start_ns = (2420 + 286) * kCycleNs;
  for (const std::uint8_t byte : message) {
    pulses.push_back(start_ns);
    for (unsigned bit = 0; bit < 8; ++bit)
      if ((byte >> bit) & 1) pulses.push_back(start_ns + (bit + 1) * kIrSentBitNs);
    pulses.push_back(start_ns + 9 * kIrSentBitNs);
    start_ns += 9 * kIrSentBitNs + 282 * kCycleNs;
  }
  return pulses;
}

FrameDecoder::Event FrameDecoder::start_frame(std::uint64_t time_ns) {
  state_ = State::kInByte;
  byte_index_ = -1;
  byte_start_ns_ = time_ns;
  value_ = 0;
  return Event::kFrameStart;
}

FrameDecoder::Event FrameDecoder::on_pulse(std::uint64_t time_ns) {
  const std::uint64_t since_ns = time_ns - byte_start_ns_;
  // No pulse for 11 bits: the receiver has given up and this is a new frame.
  if (state_ == State::kIdle || since_ns > 11 * kIrBitNs) return start_frame(time_ns);
  if (state_ == State::kBetweenBytes) {
    state_ = State::kInByte;
    ++byte_index_;
    byte_start_ns_ = time_ns;
    value_ = 0;
    return Event::kNone;
  }
  const std::uint64_t half_bit_ns = kIrBitNs / 2;
  const std::uint64_t bit =
      since_ns <= half_bit_ns ? UINT64_MAX : (since_ns - half_bit_ns) / kIrBitNs;
  if (bit > 8 || (bit < 8 && byte_index_ < 0)) {
    state_ = State::kIdle;
    return Event::kBroken;
  }
  if (bit < 8) {
    value_ = static_cast<std::uint8_t>(value_ | 1u << bit);
    return Event::kNone;
  }
  state_ = State::kBetweenBytes;
  if (byte_index_ < 0) return Event::kNone;
  message_[static_cast<unsigned>(byte_index_)] = value_;
  if (byte_index_ + 1 < static_cast<int>(kIrMessageBytes)) return Event::kNone;
  state_ = State::kIdle;
  return Event::kMessage;
}

}  // namespace swarmtalk::emulator
