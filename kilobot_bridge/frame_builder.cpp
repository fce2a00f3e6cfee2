#include "kilobot_bridge/frame_builder.hpp"

#include <algorithm>
#include <cstdio>

namespace swarmtalk::kilobot_bridge {
namespace {

OverheadFrame make_frame(OverheadType type, std::span<const std::uint8_t> payload = {}) {
  OverheadFrame frame{};
  frame[0] = kOverheadHeader;
  frame[1] = static_cast<std::uint8_t>(type);
  std::copy(payload.begin(), payload.end(), frame.begin() + kOverheadPayload);
  frame.back() = frame_checksum(frame);
  return frame;
}

OverheadFrame message_frame(OverheadType type, std::uint8_t ir_type, const IrData& data) {
  std::array<std::uint8_t, kilobot::kIrBodyBytes> payload{};
  std::copy(data.begin(), data.end(), payload.begin());
  payload.back() = ir_type;
  return make_frame(type, payload);
}

std::string hex_byte(std::uint8_t byte) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "0x%02x", byte);
  return text.data();
}

}  // namespace

std::uint8_t frame_checksum(const OverheadFrame& frame) {
  std::uint8_t sum = 0;
  for (std::size_t i = 0; i + 1 < frame.size(); ++i)
    sum = static_cast<std::uint8_t>(sum ^ frame[i]);
  return sum;
}

OverheadFrame stop_frame() {
  return make_frame(OverheadType::kStop);
}

OverheadFrame led_toggle_frame() {
  return make_frame(OverheadType::kLedToggle);
}

OverheadFrame version_question_frame() {
  return make_frame(OverheadType::kVersion);
}

OverheadFrame forward_frame(std::uint8_t ir_type, const IrData& data) {
  return message_frame(OverheadType::kForward, ir_type, data);
}

OverheadFrame forward_raw_frame(std::uint8_t ir_type, const IrData& data, std::uint16_t crc) {
  OverheadFrame frame = message_frame(OverheadType::kForwardRaw, ir_type, data);
  frame[kOverheadPayload + kilobot::kIrBodyBytes] = static_cast<std::uint8_t>(crc);
  frame[kOverheadPayload + kilobot::kIrBodyBytes + 1] = static_cast<std::uint8_t>(crc >> 8);
  frame.back() = frame_checksum(frame);
  return frame;
}

OverheadFrame ending_after(const OverheadFrame& repeated, std::chrono::nanoseconds duration) {
  constexpr std::chrono::nanoseconds kCopy = std::chrono::microseconds(kCopyMicroseconds);
  const auto copies = static_cast<std::uint16_t>(
      std::clamp<std::int64_t>((duration + kCopy).count() / kCopy.count(), 1, kMostCopies));
  OverheadFrame frame = repeated;
  frame[kOverheadCopies] = static_cast<std::uint8_t>(copies);
  frame[kOverheadCopies + 1] = static_cast<std::uint8_t>(copies >> 8);
  frame[kOverheadCopies + 2] = static_cast<std::uint8_t>(~frame[kOverheadCopies]);
  frame[kOverheadCopies + 3] = static_cast<std::uint8_t>(~frame[kOverheadCopies + 1]);
  frame.back() = frame_checksum(frame);
  return frame;
}

OverheadFrame forward_single_frame(std::uint8_t ir_type, const IrData& data) {
  return message_frame(OverheadType::kForwardSingle, ir_type, data);
}

OverheadFrame page_frame(std::uint8_t number, const ProgramPage& bytes) {
  std::array<std::uint8_t, 1 + kProgramPageBytes> payload{};
  payload[0] = number;
  std::copy(bytes.begin(), bytes.end(), payload.begin() + 1);
  return make_frame(OverheadType::kPage, payload);
}

OverheadFrame gps_frame(std::span<const GpsRecord> records) {
  std::array<std::uint8_t, std::size_t{kGpsRecords} * kGpsRecordBytes> payload{};
  auto out = payload.begin();
  const auto put16 = [&out](std::uint16_t value) {
    *out++ = static_cast<std::uint8_t>(value);
    *out++ = static_cast<std::uint8_t>(value >> 8);
  };
  for (const GpsRecord& record :
       records.first(std::min<std::size_t>(records.size(), kGpsRecords))) {
    put16(record.id);
    put16(static_cast<std::uint16_t>(record.x));
    put16(static_cast<std::uint16_t>(record.y));
    put16(static_cast<std::uint8_t>(record.theta));
  }
  return make_frame(OverheadType::kGps, payload);
}

std::string frame_problem(const OverheadFrame& frame) {
  if (frame[0] != kOverheadHeader || frame.back() != frame_checksum(frame)) {
    return "it is not a whole frame";
  }
  switch (static_cast<OverheadType>(frame[1])) {
    case OverheadType::kPage:
      if (frame[kOverheadPayload] < kProgramPages) return "";
      return "page " + std::to_string(frame[kOverheadPayload]) +
             " lies behind the last program page, " + std::to_string(kProgramPages - 1) +
             ": it would overwrite the robots' bootloader";
    case OverheadType::kForward:
    case OverheadType::kForwardRaw:
    case OverheadType::kForwardSingle: {
      const std::uint8_t type = frame_ir_type(frame);
      if (type != kilobot::kIrPage && type <= kilobot::kIrCalibrate) return "";
      return "infrared message type " + hex_byte(type) + " switches the robots' motors off";
    }
    case OverheadType::kStop:
    case OverheadType::kLedToggle:
    case OverheadType::kGps:
      return "";
    case OverheadType::kVersion:
      break;
  }
  return "frame type " + std::to_string(frame[1]) + " is none that this bridge sends";
}

}  // namespace swarmtalk::kilobot_bridge
