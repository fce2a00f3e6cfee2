// GatewayOrigin: where a message that crossed a gateway was first sent. On links whose packets can
// be marked it travels in front of the message's bytes (docs/wire-format.md).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace swarmtalk::daemon {

struct GatewayOrigin {
  std::string link;  // its name on the gateway, 1 to 64 bytes
  std::uint16_t node = 0;
  std::uint16_t epoch = 0;  // low half; 0: that link's packets tell none
  std::uint32_t number = 0;

  bool operator==(const GatewayOrigin&) const = default;
};

/// Bytes in front of a crossed message.
std::size_t origin_bytes(const GatewayOrigin& origin);

/// Appends them to `out`.
void append_origin(const GatewayOrigin& origin, std::vector<std::uint8_t>& out);

/// Reads them off the front of `bytes`, which are left with the message. @return none: malformed
std::optional<GatewayOrigin> take_origin(std::span<const std::uint8_t>& bytes);

}  // namespace swarmtalk::daemon
