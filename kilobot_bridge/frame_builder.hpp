// The frames that a host sends to the overhead controller, whole and with their checksum, and the
// one place that decides which frames may leave at all. Pure functions, used by the rest of the
// bridge. Layout: overhead_frame.hpp.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "kilobot_wire/ir_message.hpp"
#include "kilobot_wire/overhead_frame.hpp"

namespace swarmtalk::kilobot_bridge {

using OverheadFrame = std::array<std::uint8_t, kOverheadFrameBytes>;
using IrData = std::array<std::uint8_t, kilobot::kIrDataBytes>;
using ProgramPage = std::array<std::uint8_t, kProgramPageBytes>;

/// One robot's position, as 8 bytes of a kGps frame. The units are the application's.
struct GpsRecord {
  std::uint16_t id = 0;
  std::int16_t x = 0;
  std::int16_t y = 0;
  std::int8_t theta = 0;
};

OverheadFrame stop_frame();
OverheadFrame led_toggle_frame();
/// Our controller answers with a version report (gateway_frame.hpp), others do nothing.
OverheadFrame version_question_frame();
/// Repeated by the controller until its next frame.
OverheadFrame forward_frame(std::uint8_t ir_type, const IrData& data = {});
/// The same with the checksum given, right or wrong.
OverheadFrame forward_raw_frame(std::uint8_t ir_type, const IrData& data, std::uint16_t crc);
/// The same frame of a repetition that our controller ends by itself after `duration`, in its time.
/// @param duration  rounded up to a copy; at most kMostCopies of them
OverheadFrame ending_after(const OverheadFrame& repeated, std::chrono::nanoseconds duration);
/// Sent once. Controllers older than 2013 and some others ignore it silently.
OverheadFrame forward_single_frame(std::uint8_t ir_type, const IrData& data = {});
/// @param number  0 to kProgramPages - 1: what lies behind is the robots' bootloader
OverheadFrame page_frame(std::uint8_t number, const ProgramPage& bytes);
/// @param records  at most kGpsRecords; an all-zero one would end the list for the controller
OverheadFrame gps_frame(std::span<const GpsRecord> records);

/// XOR of bytes 0 to 130.
std::uint8_t frame_checksum(const OverheadFrame& frame);

/// Whether `frame` must never leave: pages behind the last program page overwrite the robots'
/// bootloader, infrared types 0x81 and 0x8B to 0xFF switch their motors off without a word, and
/// kForwardRaw with such a type is no better.
/// @return a sentence; empty: it may leave
std::string frame_problem(const OverheadFrame& frame);

/// The infrared message type that a frame of type kForward, kForwardRaw or kForwardSingle carries.
inline std::uint8_t frame_ir_type(const OverheadFrame& frame) {
  return frame[kOverheadPayload + kilobot::kIrDataBytes];
}

/// Whether the controller goes on sending until its next frame.
inline bool is_repeated(const OverheadFrame& frame) {
  return frame[1] == static_cast<std::uint8_t>(OverheadType::kForward) ||
         frame[1] == static_cast<std::uint8_t>(OverheadType::kForwardRaw);
}

}  // namespace swarmtalk::kilobot_bridge
