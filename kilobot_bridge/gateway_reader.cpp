#include "kilobot_bridge/gateway_reader.hpp"
#include <algorithm>
#include <utility>

namespace swarmtalk::kilobot_bridge {
namespace {

constexpr std::size_t kCrcBytes = 2;
constexpr std::size_t kHeadBytes = 2;  // kind and sequence
constexpr std::uint16_t kBackwards = 0x8000;

std::uint16_t read16(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | (bytes[at + 1] << 8));
}

}  // namespace

void GatewayReader::put(std::span<const std::uint8_t> bytes) {
  counters_.bytes += bytes.size();
  for (const std::uint8_t byte : bytes) {
    if (byte == 0) {
      end_frame();
    } else if (size_ < frame_.size()) {
      frame_[size_++] = byte;
    } else {
      is_too_long_ = true;
    }
  }
}

void GatewayReader::on_interrupted() {
  size_ = 0;
  is_too_long_ = is_synchronised_ = false;
  last_sequence_.reset();
  last_ticks_.reset();
  last_drops_.reset();
}

void GatewayReader::end_frame() {
  const std::size_t size = std::exchange(size_, 0);
  const bool is_too_long = std::exchange(is_too_long_, false);
  if (!std::exchange(is_synchronised_, true) || (size == 0 && !is_too_long)) return;
  std::array<std::uint8_t, kGatewayFrameMax> payload{};
  size_ = size;
  const std::size_t payload_bytes = is_too_long ? 0 : decode(payload);
  size_ = 0;
  if (payload_bytes == 0) {
    ++counters_.unreadable_frames;
    return;
  }
  take(std::span<const std::uint8_t>(payload).first(payload_bytes));
}

// COBS and checksum. @return bytes of payload; 0: it is none
std::size_t GatewayReader::decode(std::span<std::uint8_t> payload) const {
  std::size_t out = 0;
  for (std::size_t at = 0; at < size_;) {
    const std::size_t block = frame_[at];
    if (at + block > size_) return 0;
    for (std::size_t i = 1; i < block; ++i) payload[out++] = frame_[at + i];
    at += block;
    if (at < size_) payload[out++] = 0;
  }
  if (out < kHeadBytes + kCrcBytes) return 0;
  std::uint16_t crc = kilobot::kIrCrcStart;
  for (std::size_t i = 0; i + kCrcBytes < out; ++i) crc = kilobot::ir_crc_step(crc, payload[i]);
  return crc == read16(payload, out - kCrcBytes) ? out - kCrcBytes : 0;
}

void GatewayReader::take(std::span<const std::uint8_t> payload) {
  const auto kind = static_cast<GatewayKind>(payload[0]);
  const bool is_reception = kind == GatewayKind::kReception && payload.size() == kReceptionBytes;
  const bool is_hello = kind == GatewayKind::kHello && payload.size() == kHelloBytes;
  const bool is_text = kind == GatewayKind::kText && payload.size() <= kHeadBytes + kTextBytes;
  const bool is_version = kind == GatewayKind::kVersion && payload.size() == kVersionBytes;
  if (!is_reception && !is_hello && !is_text && !is_version) {
    ++counters_.unreadable_frames;
    return;
  }
  ++counters_.frames;
  if (is_version) return take_version(payload);  // the controller has numbers of its own
  if (!is_text) take_ticks(read16(payload, kHeadBytes));
  count_sequence(payload[1]);
  if (is_reception) return take_reception(payload);
  if (is_hello) return take_hello(payload);
  user_.on_text(
      {reinterpret_cast<const char*>(payload.data()) + kHeadBytes, payload.size() - kHeadBytes});
}

// The gateway's clock only goes backwards when it starts anew; its numbers then begin anew, too.
void GatewayReader::take_ticks(std::uint16_t ticks) {
  if (last_ticks_ && static_cast<std::uint16_t>(ticks - *last_ticks_) >= kBackwards) {
    ++counters_.gateway_restarts;
    last_sequence_.reset();
    last_drops_.reset();
  }
  last_ticks_ = ticks;
}

void GatewayReader::count_sequence(std::uint8_t sequence) {
  if (last_sequence_) {
    counters_.missing_frames += static_cast<std::uint8_t>(sequence - *last_sequence_ - 1);
  }
  last_sequence_ = sequence;
}

void GatewayReader::take_reception(std::span<const std::uint8_t> payload) {
  GatewayReception reception;
  std::copy_n(payload.begin() + 4, reception.data.size(), reception.data.begin());
  reception.ir_type = payload[13];
  reception.low_gain = read16(payload, 14);
  reception.high_gain = read16(payload, 16);
  if (payload[18] != kGatewayNoDistance) reception.distance_mm = payload[18];
  user_.on_reception(reception);
}

void GatewayReader::take_version(std::span<const std::uint8_t> payload) {
  user_.on_version({payload[2], payload[3], read16(payload, 4), payload[6]});
}

void GatewayReader::take_hello(std::span<const std::uint8_t> payload) {
  const std::uint16_t drops = read16(payload, 7);
  if (last_drops_) counters_.gateway_drops += static_cast<std::uint16_t>(drops - *last_drops_);
  last_drops_ = drops;
  user_.on_hello({read16(payload, 4), payload[6], read16(payload, 9)});
}

}  // namespace swarmtalk::kilobot_bridge
