#include "cli/text/hex.hpp"

#include <sodium/utils.h>

#include <cstdint>

#include "text/plain.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::cli {

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
  if (!text::is_utf8(bytes)) return std::nullopt;
  return text::escaped(bytes);
}

}  // namespace swarmtalk::cli
