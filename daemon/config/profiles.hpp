// The profiles that a link may speak, as the daemon runs them: the wire format is core's, the
// memory a computer's. One table for the configuration and for the stations, so that what the file
// may ask for and what a station does cannot drift apart.
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <string>

#include "frame/air_frame.hpp"
#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"

namespace swarmtalk::daemon {

/// What a station can carry.
struct StationLimits {
  std::uint16_t max_packet_bytes = 0;
  std::uint16_t max_message_bytes = 0;
  std::uint16_t max_timestamped_message_bytes = 0;
  std::uint8_t max_ttl = 0;
  std::uint16_t max_channel = 0;
  std::uint16_t max_node_id = 65534;
  /// Packets can say that they crossed a gateway. If not, what is sent under a node id from
  /// first_gateway_id on counts as having crossed one.
  bool marks_gateways = true;
  std::uint16_t first_gateway_id = 65535;
  std::uint16_t min_message_bytes = 0;
  /// From this channel number on channels are timestamped, below it they are not; none: any may be.
  std::uint32_t timestamped_from = core::kNoTimestampedChannels;
  bool tells_lengths = true;  // if not, messages arrive padded with zeros to whole packets

  bool carries(std::uint32_t channel) const { return channel <= max_channel; }
  bool carries(std::uint32_t channel, bool is_timestamped) const {
    if (!carries(channel)) return false;
    if (timestamped_from == core::kNoTimestampedChannels) return true;
    return is_timestamped == (channel >= timestamped_from);
  }
  std::uint16_t message_bytes(bool is_timestamped) const {
    return is_timestamped ? max_timestamped_message_bytes : max_message_bytes;
  }
};

/// A small profile's wire format with the memory of a computer: every channel, and room for the
/// messages of hundreds of robots.
template <class P>
struct Hosted : P {
  static constexpr std::uint16_t kChannels = 16;
  static constexpr std::uint16_t kForwardSlots = 256;
  static constexpr std::uint16_t kFragmentSlots = 2048;
  static constexpr std::uint16_t kRecords = 1024;
  static constexpr std::uint16_t kBuckets = 1024;
  static constexpr std::uint32_t kBufferBudgetBytes = std::uint32_t{1} << 18;
  using Counter = std::uint64_t;
  static constexpr std::uint8_t kClockBits = 32;
  static constexpr bool kHopsFromTtl = false;  // no channel has one TTL here
  static constexpr bool kLimitsForwarding = true;
};

using HostedKilobot = Hosted<core::Kilobot>;
using HostedClassic2020 = Hosted<core::Classic2020>;
using HostedFootbot = Hosted<core::Footbot>;

/// One tick of a profile's clock.
template <class P>
inline constexpr std::uint32_t kTickUs = 32'768;  // kilolib's kilo_ticks
template <>
inline constexpr std::uint32_t kTickUs<core::Wifi> = 1;
template <>
inline constexpr std::uint32_t kTickUs<HostedFootbot> = 100'000;  // ARGoS's usual step

template <class P>
constexpr StationLimits limits_of_profile() {
  using W = core::Wire<P>;
  StationLimits limits;
  limits.max_packet_bytes = W::kMtuBytes;
  limits.max_message_bytes = W::kMessageBytes;
  limits.max_timestamped_message_bytes = W::kTimedMessageBytes;
  limits.max_ttl = W::kTtlMax;
  limits.max_channel = W::kChannelMax;
  limits.max_node_id = W::kNoNode - 1;
  limits.marks_gateways = P::kGatewayBits != 0;
  limits.first_gateway_id = W::kFirstGatewayId;
  limits.min_message_bytes = W::kTellsLengths ? 0 : 1;
  limits.timestamped_from = P::kTimestampedFrom;
  limits.tells_lengths = W::kTellsLengths;
  return limits;
}

/// Which profile's packets a station speaks, for frames and for people.
struct ProfileName {
  frame::ProfileId id;
  const char* text;
};

struct ProfileEntry {
  ProfileName name;
  StationLimits limits;
};

/// In the order of frame::ProfileId.
inline constexpr ProfileEntry kProfiles[] = {
    {{frame::ProfileId::kWifi, "wifi"}, limits_of_profile<core::Wifi>()},
    {{frame::ProfileId::kKilobot, "kilobot"}, limits_of_profile<HostedKilobot>()},
    {{frame::ProfileId::kClassic2020, "classic2020"}, limits_of_profile<HostedClassic2020>()},
    {{frame::ProfileId::kFootbot, "footbot"}, limits_of_profile<HostedFootbot>()},
};

constexpr const ProfileEntry& profile_entry(frame::ProfileId id) {
  return kProfiles[static_cast<std::size_t>(id)];
}

static_assert(std::all_of(std::begin(kProfiles), std::end(kProfiles),
                          [](const ProfileEntry& entry) {
                            return &profile_entry(entry.name.id) == &entry;
                          }),
              "kProfiles is in the order of frame::ProfileId");

}  // namespace swarmtalk::daemon
