#include "kilobot_bridge/line_reader.hpp"

#include <utility>

namespace swarmtalk::kilobot_bridge {
namespace {

constexpr const char* kReplacement = "\xEF\xBF\xBD";

std::uint8_t byte_at(const std::string& bytes, std::size_t at) {
  return at < bytes.size() ? static_cast<std::uint8_t>(bytes[at]) : std::uint8_t{0};
}

// Length of the character that begins at `at`, 0 if none does (RFC 3629, section 4).
std::size_t character_bytes(const std::string& bytes, std::size_t at) {
  const std::uint8_t first = byte_at(bytes, at);
  const auto continues = [&](std::size_t i) { return (byte_at(bytes, at + i) & 0xC0) == 0x80; };
  const std::uint8_t second = byte_at(bytes, at + 1);
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return continues(1) ? 2 : 0;
  if (first >= 0xE0 && first <= 0xEF) {
    if (!continues(1) || !continues(2)) return 0;
    if (first == 0xE0 && second < 0xA0) return 0;  // longer than needed
    if (first == 0xED && second > 0x9F) return 0;  // half of a surrogate pair
    return 3;
  }
  if (first >= 0xF0 && first <= 0xF4) {
    if (!continues(1) || !continues(2) || !continues(3)) return 0;
    if (first == 0xF0 && second < 0x90) return 0;
    if (first == 0xF4 && second > 0x8F) return 0;
    return 4;
  }
  return 0;
}

}  // namespace

std::string to_utf8(const std::string& bytes) {
  std::string text;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t size = character_bytes(bytes, at);
    if (size == 0) {
      text += kReplacement;
      ++at;
    } else {
      text.append(bytes, at, size);
      at += size;
    }
  }
  return text;
}

void LineReader::put(std::span<const std::uint8_t> bytes) {
  counters_.bytes += bytes.size();
  for (const std::uint8_t byte : bytes) {
    if (byte == '\n') {
      end_line();
    } else if (byte == '\r') {
      continue;
    } else if (line_.size() < kMostBytes) {
      line_ += static_cast<char>(byte);
    } else {
      is_cut_ = true;
    }
  }
}

void LineReader::on_interrupted() {
  line_.clear();
  is_cut_ = false;
}

void LineReader::end_line() {
  counters_.cut_lines += std::exchange(is_cut_, false) ? 1 : 0;
  const std::string line = std::exchange(line_, {});
  if (line.empty()) return;
  ++counters_.lines;
  on_line_(to_utf8(line));
}

}  // namespace swarmtalk::kilobot_bridge
