#include "kilobot_bridge/frame_padding.hpp"

#include <algorithm>

namespace swarmtalk::kilobot_bridge {
namespace {

constexpr std::uint8_t kFirstHarmless = 7;  // from here on a controller only stops repeating
constexpr unsigned kByteValues = 0x100;

bool is_dangerous(std::uint8_t type) {
  return type != static_cast<std::uint8_t>(OverheadType::kStop) && type < kFirstHarmless;
}

void shift_in(std::span<std::uint8_t> window, std::span<const std::uint8_t> bytes) {
  if (bytes.size() >= window.size()) {
    std::copy(bytes.end() - static_cast<std::ptrdiff_t>(window.size()), bytes.end(),
              window.begin());
    return;
  }
  std::move(window.begin() + static_cast<std::ptrdiff_t>(bytes.size()), window.end(),
            window.begin());
  std::copy(bytes.begin(), bytes.end(), window.end() - static_cast<std::ptrdiff_t>(bytes.size()));
}

}  // namespace

// The parser itself, over what was sent before, the padding, and the frame up to its last byte.
bool FramePadding::is_safe(const Window& before, unsigned bytes, std::uint8_t first,
                           const OverheadFrame& frame) {
  std::array<std::uint8_t, 2 * kOverheadFrameBytes + kMost> line{};
  std::copy(before.begin(), before.end(), line.begin());
  if (bytes > 0) line[kOverheadFrameBytes] = first;
  std::copy(frame.begin(), frame.end(), line.begin() + kOverheadFrameBytes + bytes);
  std::uint8_t sum = 0;
  for (const std::uint8_t byte : before) sum = static_cast<std::uint8_t>(sum ^ byte);
  const std::size_t last = kOverheadFrameBytes + bytes + kOverheadFrameBytes - 1;
  for (std::size_t i = kOverheadFrameBytes; i < last; ++i) {
    const std::size_t begin = i + 1 - kOverheadFrameBytes;
    sum = static_cast<std::uint8_t>(sum ^ line[i] ^ line[begin - 1]);
    if (sum == 0 && line[begin] == kOverheadHeader && is_dangerous(line[begin + 1])) return false;
  }
  return true;
}

std::vector<std::uint8_t> FramePadding::pad(const OverheadFrame& frame) const {
  std::vector<std::uint8_t> bytes;
  for (unsigned first = 0; first < kByteValues && bytes.empty(); ++first) {
    if (first == kOverheadHeader) continue;  // it would begin a frame itself
    const auto byte = static_cast<std::uint8_t>(first);
    for (unsigned count = 0; count <= kMost && bytes.empty(); ++count) {
      if (!is_safe(sent_, count, byte, frame) || !is_safe(since_reopen_, count, byte, frame)) {
        continue;
      }
      bytes.resize(count);
      if (count > 0) bytes.front() = byte;
      bytes.insert(bytes.end(), frame.begin(), frame.end());
    }
  }
  return bytes;
}

void FramePadding::on_written(std::span<const std::uint8_t> bytes) {
  shift_in(sent_, bytes);
  shift_in(since_reopen_, bytes);
}

void FramePadding::on_reopened() {
  since_reopen_ = {};
}

}  // namespace swarmtalk::kilobot_bridge
