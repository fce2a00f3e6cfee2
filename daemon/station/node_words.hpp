// What core and the daemon tell each other, in the other's words: ranges, receptions, counters.
// Pure functions for a station's use.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "daemon/config/profiles.hpp"
#include "daemon/pose/ranging.hpp"
#include "drivers/link/link.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::daemon {

/// What core is told of a range. The hub gets the range itself: some profiles know no bearing, and
/// count in millimetres.
template <class Sensing>
Sensing sensing_of(const Range& range);
template <>
inline core::PoseSensing sensing_of(const Range& range) {
  return {range.distance_m, range.bearing_rad, 0};
}
template <>
inline core::DistanceSensing sensing_of(const Range& range) {
  return {range.distance_mm()};
}
template <>
inline core::RangeBearingSensing sensing_of(const Range& range) {
  return {range.distance_mm(), range.bearing_rad};
}

inline std::uint64_t nanoseconds(drivers::MonotonicTime time) {
  const auto since = std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch());
  return static_cast<std::uint64_t>(since.count());
}

/// Longest message on a link whose packets have at most so many bytes.
template <class P>
std::size_t message_bytes_that_fit(std::size_t packet_bytes, bool is_timestamped) {
  using W = core::Wire<P>;
  if (packet_bytes >= W::kMtuBytes) return limits_of_profile<P>().message_bytes(is_timestamped);
  if (P::kPadded) return 0;  // every packet has its full length
  // All packets of a message but the last are of the profile's full length, so only a message of
  // one packet fits.
  const std::size_t around =
      W::kHeaderBytes + W::kChecksumBytes + (is_timestamped ? W::kTimestampBytes : 0);
  return packet_bytes < around ? 0 : packet_bytes - around;
}

/// Hops that a message has travelled. Where packets count none, one that its origin transmitted is
/// all that can be told.
/// @param transmitter  of the frame; 0: not known
template <class P>
std::uint8_t hops_of(const core::Reception<P>& reception, std::uint16_t transmitter) {
  const bool is_direct = reception.hops == core::kHopsUnknown && P::kHopsBits == 0 &&
                         transmitter != 0 && transmitter == reception.node;
  return is_direct ? std::uint8_t{0} : reception.hops;
}

/// Until the kernel's stamp; what has passed since, whoever hands the message on adds.
template <class P>
std::optional<std::uint32_t> delay_us(const core::Reception<P>& reception) {
  if (!reception.has_delay) return std::nullopt;
  return static_cast<std::uint32_t>(
      std::min<std::uint64_t>(std::uint64_t{reception.delay_ticks} * kTickUs<P>, UINT32_MAX));
}

/// @param repairs  parity packets, which the node has counted as bad packets
template <class P>
drivers::Counters node_counters(const core::Counters<P>& c, std::uint64_t repairs) {
  return {
      {"node_packets_forwarded", c.packets_forwarded},
      {"node_messages_sent", c.messages_sent},
      {"node_messages_received", c.messages_received},
      {"node_bad_packets", c.bad_packets - repairs},
      {"node_bad_checksums", c.bad_checksums},
      {"node_unknown_channels", c.unknown_channels},
      {"node_duplicates", c.duplicates},
      {"node_own_echoes", c.own_echoes},
      {"node_forward_queue_full", c.forward_queue_full},
      {"node_no_memory", c.no_memory},
      {"node_aged_out", c.aged_out},
      {"node_contradictions", c.contradictions},
      {"node_id_collisions", c.id_collisions},
  };
}

}  // namespace swarmtalk::daemon
