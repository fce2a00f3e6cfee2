// FramePadding: what must go on the line before a frame so that the controller finds no dangerous
// frame that nobody has sent. The controller's parser takes any 132 bytes that begin with 0x55 and
// XOR to zero, so a frame whose beginning resembles the one before it may complete a "false" one on
// the border of the two; types 1 to 6 of those do harm. Some bytes in between move the border.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "kilobot_bridge/frame_builder.hpp"

namespace swarmtalk::kilobot_bridge {

class FramePadding {
 public:
  static constexpr unsigned kMost = 131;  // bytes

  /// Bytes to write in one go: as few zeros as will do, then the frame. If no number of zeros will
  /// do, the first of them is another byte; there always is one: kMost bytes push all that came
  /// before out of the controller's window, and each frame before rules out 65 values at most.
  std::vector<std::uint8_t> pad(const OverheadFrame& frame) const;

  /// These bytes have been handed to the line.
  void on_written(std::span<const std::uint8_t> bytes);

  /// The controller may have been reset since, and then knows nothing of what was written before:
  /// from here on frames are safe in either case.
  void on_reopened();

 private:
  using Window = std::array<std::uint8_t, kOverheadFrameBytes>;  // oldest byte first

  static bool is_safe(const Window& before, unsigned bytes, std::uint8_t first,
                      const OverheadFrame& frame);

  Window sent_{};          // the last bytes written; zeros before the first
  Window since_reopen_{};  // the same as if zeros had come before the reopening
};

}  // namespace swarmtalk::kilobot_bridge
