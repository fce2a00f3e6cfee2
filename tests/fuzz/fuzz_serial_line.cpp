// Fuzz target: any bytes from a serial line, with a gateway Kilobot or a robot that prints text at
// its other end. First byte: in what portions they come, and after how many the line is
// interrupted. How they were cut makes no difference, and every line can be shown.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "kilobot_bridge/gateway_reader.hpp"
#include "kilobot_bridge/line_reader.hpp"

namespace {

using namespace swarmtalk::kilobot_bridge;

constexpr std::size_t kMostPortion = 16;

void check(bool is_as_it_must_be) {
  if (!is_as_it_must_be) std::abort();
}

class Listener final : public GatewayUser {
 public:
  void on_reception(const GatewayReception& reception) override {
    heard.append(reception.data.begin(), reception.data.end());
    heard += static_cast<char>(reception.ir_type);
  }
  void on_hello(const GatewayHello& hello) override { heard += std::to_string(hello.uid); }
  void on_version(const ControllerVersion& version) override {
    heard += std::to_string(version.product) + std::to_string(version.version);
  }
  void on_text(std::string_view text) override {
    check(text.size() <= swarmtalk::kilobot_bridge::kTextBytes);
    heard += text;
  }
  std::string heard;
};

struct Heard {
  std::string frames;
  std::vector<std::string> lines;
  bool operator==(const Heard&) const = default;
};

Heard hear(std::span<const std::uint8_t> bytes, std::size_t portion, std::size_t interrupted_at) {
  Listener listener;
  Heard heard;
  GatewayReader frames(listener);
  LineReader lines([&](const std::string& line) {
    check(!line.empty() && to_utf8(line) == line);
    check(line.find('\n') == std::string::npos);
    heard.lines.push_back(line);
  });
  for (std::size_t at = 0; at < bytes.size();) {
    if (at == interrupted_at) {
      frames.on_interrupted();
      lines.on_interrupted();
    }
    std::size_t size = std::min(portion, bytes.size() - at);
    if (at < interrupted_at) size = std::min(size, interrupted_at - at);
    frames.put(bytes.subspan(at, size));
    lines.put(bytes.subspan(at, size));
    at += size;
  }
  check(frames.counters().bytes == bytes.size() && lines.counters().bytes == bytes.size());
  check(lines.counters().lines == heard.lines.size());
  check(frames.counters().frames + frames.counters().unreadable_frames <= bytes.size());
  heard.frames = listener.heard;
  return heard;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const std::uint8_t> rest(bytes + 1, size - 1);
  const std::size_t portion = 1 + bytes[0] % kMostPortion;
  const std::size_t interrupted_at = bytes[0] / kMostPortion * 10;
  check(hear(rest, portion, interrupted_at) == hear(rest, rest.size() + 1, interrupted_at));
  return 0;
}
