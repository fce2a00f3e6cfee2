// Packets of the profile `wifi` for tests, by hand.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "redundancy/erasure_code.hpp"
#include "redundancy/repair_sender.hpp"
#include "redundancy/wifi_packet.hpp"

namespace swarmtalk::redundancy::testing {

inline constexpr std::size_t kFull = Wire::kPayloadBytes;

inline Header header_of(std::uint32_t number, std::size_t size, std::uint16_t channel = 7,
                        std::uint8_t ttl = 0) {
  Header header{};
  header.node = 300;
  header.epoch = 4660;
  header.channel = channel;
  header.message = number;
  header.ttl = ttl;
  header.size = static_cast<std::uint16_t>(size);
  return header;
}

/// The packets of a message of `size` bytes, as a node writes them.
inline std::vector<Bytes> packets_of(Header header, bool is_timestamped = false) {
  header.has_delay = is_timestamped;
  const std::size_t full = payload_max(header);
  std::vector<Bytes> packets;
  for (std::size_t at = 0; at == 0 || at < header.size; at += full) {
    const std::size_t bytes = std::min(full, header.size - at);
    header.sequence = static_cast<Wire::Sequence>(packets.size());
    header.end = at + bytes == header.size;
    Bytes& packet = packets.emplace_back(Wire::kHeaderBytes);
    Wire::encode(header, packet.data());
    for (std::size_t i = 0; i < bytes; ++i) {
      packet.push_back(static_cast<std::uint8_t>((at + i) * 31 + header.message));
    }
    packet.resize(packet.size() + timestamp_bytes(header));
  }
  return packets;
}

/// The packets of a message and its parity packets, as they leave.
inline std::vector<Bytes> protected_packets(const Header& header, unsigned repairs,
                                            bool is_timestamped = false) {
  RepairSender sender;
  sender.protect(header.channel, header.message, repairs);
  std::vector<Bytes> packets = packets_of(header, is_timestamped);
  std::uint64_t frame = 0;
  for (Bytes& packet : packets) sender.sent(packet, ++frame, 0);
  while (sender.has_parity()) {
    Bytes& packet = packets.emplace_back(sender.parity_bytes());
    sender.take_parity(packet, 0);
  }
  return packets;
}

}  // namespace swarmtalk::redundancy::testing
