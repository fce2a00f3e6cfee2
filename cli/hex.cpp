#include "cli/hex.hpp"

#include <cstdint>
#include <cstdio>

#include "client_lib/utf8.hpp"

namespace swarmtalk::cli {
namespace {

int digit_value(char digit) {
  if (digit >= '0' && digit <= '9') return digit - '0';
  if (digit >= 'a' && digit <= 'f') return digit - 'a' + 10;
  if (digit >= 'A' && digit <= 'F') return digit - 'A' + 10;
  return -1;
}

bool is_for_a_terminal(std::uint32_t code) {
  return code >= 0x20 && code != '\\' && (code < 0x7F || code >= 0xA0);
}

std::string escape(std::uint32_t code) {
  if (code == '\n') return "\\n";
  if (code == '\t') return "\\t";
  if (code == '\r') return "\\r";
  if (code == '\\') return "\\\\";
  char text[8];
  std::snprintf(text, sizeof(text), code < 0x80 ? "\\x%02x" : "\\u%04x", code);
  return text;
}

}  // namespace

std::string to_hex(std::string_view bytes) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string digits;
  digits.reserve(2 * bytes.size());
  for (const char byte : bytes) {
    digits += kDigits[static_cast<std::uint8_t>(byte) >> 4];
    digits += kDigits[static_cast<std::uint8_t>(byte) & 15];
  }
  return digits;
}

std::optional<std::string> from_hex(std::string_view digits) {
  if (digits.starts_with("0x")) digits.remove_prefix(2);
  std::string bytes;
  int high = -1;
  for (const char digit : digits) {
    if (high < 0 && (digit == ' ' || digit == ':' || digit == '\n')) continue;
    const int value = digit_value(digit);
    if (value < 0) return std::nullopt;
    if (high < 0) {
      high = value;
    } else {
      bytes += static_cast<char>(high * 16 + value);
      high = -1;
    }
  }
  if (high >= 0) return std::nullopt;
  return bytes;
}

std::optional<std::string> escaped(std::string_view bytes) {
  std::string text;
  for (std::size_t at = 0; at < bytes.size();) {
    const std::size_t begin = at;
    const auto code = client::next_code_point(bytes, at);
    if (!code) return std::nullopt;
    if (is_for_a_terminal(*code)) {
      text += bytes.substr(begin, at - begin);
    } else {
      text += escape(*code);
    }
  }
  return text;
}

}  // namespace swarmtalk::cli
