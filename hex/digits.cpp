#include "hex/digits.hpp"

#include <sodium/utils.h>

namespace swarmtalk::hex {

std::string to_hex(std::span<const std::uint8_t> bytes) {
  std::string digits(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(digits.data(), digits.size(), bytes.data(), bytes.size());
  digits.pop_back();  // its zero
  return digits;
}

std::string to_hex(std::string_view bytes) {
  return to_hex({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
}

std::optional<std::string> from_hex(std::string_view digits) {
  if (digits.starts_with("0x")) digits.remove_prefix(2);
  if (digits.find('\0') != std::string_view::npos) return std::nullopt;  // sodium skips it
  std::string bytes(digits.size() / 2 + 1, '\0');
  std::size_t size = 0;
  if (sodium_hex2bin(reinterpret_cast<std::uint8_t*>(bytes.data()), bytes.size(), digits.data(),
                     digits.size(), " :\t\r\n", &size, nullptr) != 0) {
    return std::nullopt;
  }
  bytes.resize(size);
  return bytes;
}

}  // namespace swarmtalk::hex
