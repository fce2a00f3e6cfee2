#include "daemon/common/printable.hpp"

#include <algorithm>
#include <cstdint>

namespace swarmtalk::daemon {
namespace {

bool is_control(char c) {
  return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

/// Bytes of the UTF-8 character that begins at `at`, by RFC 3629; 0 if none does.
std::size_t character_bytes(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<std::uint8_t>(text[i]) : std::uint8_t{0};
  };
  const std::uint8_t lead = byte(at);
  if (lead < 0x80) return 1;
  if (lead < 0xC2 || lead > 0xF4) return 0;
  const std::size_t size = lead < 0xE0 ? 2 : lead < 0xF0 ? 3 : 4;
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(at + i) & 0xC0u) != 0x80u) return 0;
  }
  // Overlong, a surrogate, or beyond U+10FFFF.
  const std::uint8_t next = byte(at + 1);
  const bool is_wrong = (lead == 0xE0 && next < 0xA0) || (lead == 0xED && next > 0x9F) ||
                        (lead == 0xF0 && next < 0x90) || (lead == 0xF4 && next > 0x8F);
  return is_wrong ? 0 : size;
}

}  // namespace

std::string printable(std::string_view text, std::size_t most_bytes) {
  std::string line;
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t size = character_bytes(text, at);
    const std::size_t taken = std::max<std::size_t>(size, 1);
    if (line.size() + taken > most_bytes) return line + "...";
    if (size == 0 || is_control(text[at])) {
      line += '?';
    } else {
      line += text.substr(at, size);
    }
    at += taken;
  }
  return line;
}

}  // namespace swarmtalk::daemon
