// Pacing: how long the line towards the overhead controller must be silent after each frame. The
// stock controller has two weak spots: bytes that arrive while it sends infrared damage that
// message, and while it sends a page or positions it is deaf. All times are the controller's; a
// time_scale turns them into ours, for an emulator that does not run in real time.
#pragma once

#include <chrono>

#include "kilobot_bridge/frame_builder.hpp"

namespace swarmtalk::kilobot_bridge {

using Duration = std::chrono::nanoseconds;

inline constexpr unsigned kDefaultBaud = 38400;
inline constexpr unsigned kBitsPerByte = 10;  // 8N1

/// Silence after the last byte of a frame. Measured on the standard controller's image
/// (docs/kilobot-emulator.md): a message is on the air for 4.4 ms of each 10.4 ms, and the frame
/// before it is given up at the end of such a pass only.
struct Silences {
  Duration first_copy = std::chrono::microseconds(15'000);
  Duration further_copy = std::chrono::microseconds(10'400);
  Duration single = std::chrono::milliseconds(8);
  Duration page = std::chrono::milliseconds(131);
  Duration gps_record = std::chrono::microseconds(4'500);
  Duration gps = std::chrono::milliseconds(10);  // beside the records
  Duration other = std::chrono::milliseconds(12);
};

struct Pacing {
  Silences silences;
  unsigned copies = 3;  // of a message that is repeated, at least
  unsigned baud = kDefaultBaud;
  double time_scale = 1.0;  // seconds of the controller per second of ours

  /// The least silence after `frame`, in the controller's time.
  Duration silence_after(const OverheadFrame& frame) const {
    switch (static_cast<OverheadType>(frame[1])) {
      case OverheadType::kForward:
      case OverheadType::kForwardRaw:
        return silences.first_copy + (copies - 1) * silences.further_copy;
      case OverheadType::kForwardSingle:
        return silences.single;
      case OverheadType::kPage:
        return silences.page;
      case OverheadType::kGps:
        return silences.gps + kGpsRecords * silences.gps_record;
      default:
        return silences.other;
    }
  }

  /// How long so many bytes take on the line, in the controller's time.
  Duration line_time(std::size_t size_bytes) const {
    return Duration(std::chrono::seconds(1)) * (size_bytes * kBitsPerByte) / baud;
  }

  /// A time of the controller in our own.
  Duration to_ours(Duration time) const {
    return std::chrono::duration_cast<Duration>(
        std::chrono::duration<double, std::nano>(static_cast<double>(time.count()) / time_scale));
  }
};

}  // namespace swarmtalk::kilobot_bridge
