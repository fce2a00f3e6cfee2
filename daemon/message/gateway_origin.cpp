#include "daemon/message/gateway_origin.hpp"

#include "daemon/common/names.hpp"

namespace swarmtalk::daemon {
namespace {

constexpr std::size_t kNumbersBytes = 2 + 2 + 4;  // node, epoch, number

void append_big_endian(std::uint32_t value, int bytes, std::vector<std::uint8_t>& out) {
  while (bytes-- > 0) out.push_back(static_cast<std::uint8_t>(value >> (8 * bytes)));
}

std::uint32_t take_big_endian(std::span<const std::uint8_t>& bytes, std::size_t count) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes.first(count)) value = value << 8 | byte;
  bytes = bytes.subspan(count);
  return value;
}

}  // namespace

std::size_t origin_bytes(const GatewayOrigin& origin) {
  return 1 + origin.link.size() + kNumbersBytes;
}

void append_origin(const GatewayOrigin& origin, std::vector<std::uint8_t>& out) {
  out.push_back(static_cast<std::uint8_t>(origin.link.size()));
  out.insert(out.end(), origin.link.begin(), origin.link.end());
  append_big_endian(origin.node, 2, out);
  append_big_endian(origin.epoch, 2, out);
  append_big_endian(origin.number, 4, out);
}

std::optional<GatewayOrigin> take_origin(std::span<const std::uint8_t>& bytes) {
  if (bytes.empty()) return std::nullopt;
  const std::size_t name_bytes = bytes[0];
  if (bytes.size() < 1 + name_bytes + kNumbersBytes) return std::nullopt;
  GatewayOrigin origin;
  origin.link.assign(bytes.begin() + 1,
                     bytes.begin() + 1 + static_cast<std::ptrdiff_t>(name_bytes));
  if (!is_legal_name(origin.link)) return std::nullopt;
  bytes = bytes.subspan(1 + name_bytes);
  origin.node = static_cast<std::uint16_t>(take_big_endian(bytes, 2));
  origin.epoch = static_cast<std::uint16_t>(take_big_endian(bytes, 2));
  origin.number = take_big_endian(bytes, 4);
  return origin;
}

}  // namespace swarmtalk::daemon
