// FrameFinder: how an overhead controller finds frames in its serial input, exactly: a window over
// the last 132 bytes that is a frame whenever it starts with 0x55 and the XOR of all is zero. There
// is no time-out and no state, so it recovers from anything, and it also finds "false" frames that
// lie across the border of two real ones.
#pragma once

#include <cstdint>
#include <optional>

#include "kilobot_wire/ohc_frame.hpp"

namespace swarmtalk::ohc_double {

struct FoundFrame {
  Frame frame{};
  /// It overlaps a real frame, one that began where the last real one had ended or later: the host
  /// has not meant it.
  bool is_false = false;
};

class FrameFinder {
 public:
  std::optional<FoundFrame> put(std::uint8_t byte) {
    sum_ = static_cast<std::uint8_t>(sum_ ^ window_[head_] ^ byte);
    window_[head_] = byte;
    head_ = (head_ + 1) % kFrameBytes;
    ++since_real_;
    if (window_[head_] != kFrameHeader || sum_ != 0) return std::nullopt;
    FoundFrame found;
    for (std::size_t i = 0; i < kFrameBytes; ++i)
      found.frame[i] = window_[(head_ + i) % kFrameBytes];
    found.is_false = since_real_ < kFrameBytes;
    if (!found.is_false) since_real_ = 0;
    return found;
  }

 private:
  std::array<std::uint8_t, kFrameBytes> window_{};
  std::size_t head_ = 0;
  std::uint8_t sum_ = 0;
  std::uint64_t since_real_ = kFrameBytes;  // bytes since the end of the last real frame
};

}  // namespace swarmtalk::ohc_double
