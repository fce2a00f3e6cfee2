#include "cli/hex.hpp"

#include <sodium/utils.h>

#include <cstdint>
#include <cstdio>

#include "client_lib/utf8.hpp"

namespace swarmtalk::cli {
namespace {

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
  std::string digits(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(digits.data(), digits.size(), reinterpret_cast<const std::uint8_t*>(bytes.data()),
                 bytes.size());
  digits.pop_back();  // its zero
  return digits;
}

std::optional<std::string> from_hex(std::string_view digits) {
  if (digits.starts_with("0x")) digits.remove_prefix(2);
  std::string bytes(digits.size() / 2 + 1, '\0');
  std::size_t size = 0;
  if (sodium_hex2bin(reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size(), digits.data(),
                     digits.size(), " :\n", &size, nullptr) != 0) {
    return std::nullopt;
  }
  bytes.resize(size);
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
