// What is in an air frame: its header, and the headers of its packets, whatever their profile. The
// one place where the command line knows the formats of the air. Pure functions; any bytes are
// safe.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "frame/air_frame.hpp"

namespace swarmtalk::cli {

/// One packet, its header in plain numbers.
struct AirPacket {
  std::uint32_t node = 0;  // origin of the message
  std::uint32_t message = 0;
  std::uint32_t sequence = 0;  // of the packet in its message
  bool is_last = false;        // the message's last packet
  std::uint16_t channel = 0;
  std::uint32_t ttl = 0;
  std::optional<std::uint32_t> hops;          // travelled, if the profile carries them
  std::optional<std::uint32_t> message_size;  // bytes, if the profile carries them
  std::optional<std::uint32_t> epoch;         // of the origin, if the profile carries it
  bool is_timestamped = false;
  bool crossed_gateway = false;
  std::span<const std::uint8_t> payload;  // without header, timestamp and checksum
  std::uint32_t size_bytes = 0;           // all of it
};

/// "wifi", as configurations write it; "profile 9" for one that nobody knows.
std::string profile_name(frame::ProfileId profile);

/// @return none: the packet is shorter than its header, or the profile is unknown
std::optional<AirPacket> decode_packet(frame::ProfileId profile,
                                       std::span<const std::uint8_t> packet);

}  // namespace swarmtalk::cli
