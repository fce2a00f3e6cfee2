// What the parts of this folder read in a packet of the `wifi` profile. docs/wire-format.md draws
// it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "swarmtalk/profiles/wifi.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk::redundancy {

using Wire = core::Wire<core::Wifi>;
using Header = Wire::Header;

/// How many parity packets the packet's message has; in each of its packets and in the parity
/// packets themselves. The first of the header's bits that are 0 otherwise.
using ParitiesField = core::bits::Field<Wire::kGatewayAt + core::Wifi::kGatewayBits, 4>;
inline constexpr std::size_t kParitiesByte = ParitiesField::kFirst;
inline constexpr std::uint8_t kParitiesMask = ParitiesField::kMask << ParitiesField::kShift;
static_assert(ParitiesField::kFirst == ParitiesField::kLast);
static_assert(ParitiesField::kLast < Wire::kHeaderBytes);

/// Whether parity packets of the packet's message were made, or it is one.
inline bool is_marked(std::span<const std::uint8_t> packet) {
  return packet.size() >= Wire::kHeaderBytes && (packet[kParitiesByte] & kParitiesMask) != 0;
}

/// Bytes of a message in each of its packets but the last, and of each parity packet.
inline std::size_t payload_max(const Header& header) {
  return header.has_delay ? Wire::kTimedPayloadBytes : Wire::kPayloadBytes;
}
inline std::size_t timestamp_bytes(const Header& header) {
  return header.has_delay ? Wire::kTimestampBytes : 0;
}
/// Packets of the message, without parity packets.
inline unsigned source_packets(const Header& header) {
  return Wire::packets_for(header.size, static_cast<std::uint16_t>(payload_max(header)));
}

/// The bytes of a packet between header and timestamp. @pre it is long enough for both
inline std::span<const std::uint8_t> payload(std::span<const std::uint8_t> packet,
                                             const Header& header) {
  return packet.subspan(Wire::kHeaderBytes,
                        packet.size() - Wire::kHeaderBytes - timestamp_bytes(header));
}

/// Whether a packet is a parity packet, whole and within what its header says.
inline bool is_parity(std::span<const std::uint8_t> packet, const Header& header) {
  const unsigned sources = source_packets(header);
  const unsigned limit = header.has_delay ? Wire::kTimedMessageBytes : Wire::kMessageBytes;
  return header.size <= limit && sources > 1 && !header.end && header.sequence >= sources &&
         header.sequence - sources < unsigned{ParitiesField::get(packet.data())} &&
         packet.size() == Wire::kHeaderBytes + payload_max(header) + timestamp_bytes(header);
}

/// Adds a wait to the timestamp of a packet, if it has one.
inline void add_wait(std::span<std::uint8_t> packet, std::uint64_t waited_us) {
  if (!Wire::is_timestamped(packet.data())) return;
  const auto size = static_cast<Wire::PacketSize>(packet.size());
  const std::uint64_t most = Wire::kTimestampMax;
  const auto waited = static_cast<Wire::WaitTicks>(waited_us < most ? waited_us : most);
  Wire::set_timestamp(packet.data(), size,
                      Wire::later(Wire::timestamp(packet.data(), size), waited));
}

/// Which message a packet is of.
struct MessageName {
  std::uint16_t node = 0;
  std::uint16_t epoch = 0;
  std::uint16_t channel = 0;
  std::uint32_t number = 0;
  bool operator==(const MessageName&) const = default;
};
inline MessageName name_of(const Header& header) {
  return {header.node, header.epoch, header.channel, header.message};
}

}  // namespace swarmtalk::redundancy
