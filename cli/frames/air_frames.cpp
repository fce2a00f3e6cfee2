#include "cli/frames/air_frames.hpp"

#include "swarmtalk/profiles/classic2020.hpp"
#include "swarmtalk/profiles/footbot.hpp"
#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/profiles/wifi.hpp"
#include "swarmtalk/wire.hpp"

namespace swarmtalk::cli {
namespace {

template <class P>
std::optional<AirPacket> decode(std::span<const std::uint8_t> bytes) {
  using Wire = core::Wire<P>;
  if (bytes.size() < Wire::kHeaderBytes + Wire::kChecksumBytes) return std::nullopt;
  const typename Wire::Header header = Wire::decode(bytes.data());
  AirPacket packet;
  packet.node = header.node;
  packet.message = header.message;
  packet.sequence = header.sequence;
  packet.is_last = header.end;
  packet.channel = header.channel;
  packet.ttl = header.ttl;
  if (P::kHopsBits != 0) packet.hops = header.hops;
  if (P::kSizeBits != 0) packet.message_size = header.size;
  if (P::kEpochBits != 0) packet.epoch = header.epoch;
  packet.is_timestamped = header.has_delay;
  packet.crossed_gateway = header.crossed_gateway;
  packet.size_bytes = static_cast<std::uint32_t>(bytes.size());
  const std::size_t behind =
      Wire::kChecksumBytes + (header.has_delay ? std::size_t{Wire::kTimestampBytes} : 0);
  packet.payload = bytes.subspan(Wire::kHeaderBytes);
  packet.payload =
      packet.payload.first(packet.payload.size() < behind ? 0 : packet.payload.size() - behind);
  return packet;
}

}  // namespace

std::string profile_name(frame::ProfileId profile) {
  switch (profile) {
    case frame::ProfileId::kWifi:
      return "wifi";
    case frame::ProfileId::kKilobot:
      return "kilobot";
    case frame::ProfileId::kClassic2020:
      return "classic2020";
    case frame::ProfileId::kFootbot:
      return "footbot";
  }
  return "profile " + std::to_string(static_cast<unsigned>(profile));
}

std::optional<AirPacket> decode_packet(frame::ProfileId profile,
                                       std::span<const std::uint8_t> packet) {
  switch (profile) {
    case frame::ProfileId::kWifi:
      return decode<core::Wifi>(packet);
    case frame::ProfileId::kKilobot:
      return decode<core::Kilobot>(packet);
    case frame::ProfileId::kClassic2020:
      return decode<core::Classic2020>(packet);
    case frame::ProfileId::kFootbot:
      return decode<core::Footbot>(packet);
  }
  return std::nullopt;
}

}  // namespace swarmtalk::cli
