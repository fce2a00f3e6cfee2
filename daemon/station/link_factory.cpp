#include "daemon/station/link_factory.hpp"

#include <stdexcept>

#include "drivers/link/link_error.hpp"
#include "drivers/replay.hpp"
#include "drivers/socket/raw_l2.hpp"
#include "drivers/socket/udp.hpp"
#include "kilobot_bridge/kilobot_link.hpp"

namespace swarmtalk::daemon {
namespace {

kilobot_bridge::KilobotLinkConfig kilobot_link_config(const KilobotConfig& config,
                                                      frame::ProfileId profile) {
  kilobot_bridge::KilobotLinkConfig link;
  link.downlink = config.downlink;
  link.uplink = config.uplink;
  link.uplink_form =
      config.is_text ? kilobot_bridge::UplinkForm::kText : kilobot_bridge::UplinkForm::kFrames;
  link.profile = profile;
  link.pacing.copies = config.copies;
  link.pacing.baud = config.baud;
  link.pacing.time_scale = config.time_scale;
  link.has_single = config.ohc_single;
  link.settle = std::chrono::milliseconds(config.settle_ms);
  return link;
}

std::unique_ptr<drivers::Link> open(boost::asio::io_context& io, const LinkConfig& config,
                                    frame::ProfileId profile, std::size_t max_packet_bytes) {
  switch (config.type) {
    case LinkType::kRawL2: {
      drivers::RawL2Config raw;
      raw.interface = config.interface;
      raw.ethertype = config.ethertype;
      raw.profile = profile;
      raw.max_packet_bytes = max_packet_bytes;
      raw.pacer = pacing_of(config);
      raw.receive_buffer_bytes = config.receive_buffer_bytes;
      return std::make_unique<drivers::RawL2Link>(io, raw);
    }
    case LinkType::kUdp: {
      drivers::UdpConfig udp;
      if (!config.address.empty()) udp.address = config.address;
      if (config.port != 0) udp.port = config.port;
      udp.interface = config.interface;
      udp.profile = profile;
      udp.max_packet_bytes = max_packet_bytes;
      udp.pacer = pacing_of(config);
      udp.receive_buffer_bytes = config.receive_buffer_bytes;
      return std::make_unique<drivers::UdpLink>(io, udp);
    }
    case LinkType::kKilobot:
      return std::make_unique<kilobot_bridge::KilobotLink>(
          io, kilobot_link_config(config.kilobot, profile));
    case LinkType::kReplay:
      break;
  }
  drivers::ReplayConfig replay;
  replay.capture_path = config.file;
  replay.output_path = config.output;
  replay.pace = config.is_fastest ? drivers::ReplayPace::kFastest : drivers::ReplayPace::kRecorded;
  replay.ethertype = config.ethertype;
  replay.profile = profile;
  replay.max_packet_bytes = max_packet_bytes;
  return std::make_unique<drivers::ReplayLink>(io, replay);
}

/// What the key of a driver's setting is called in a [links.NAME] section.
std::string key_of(drivers::LinkSetting setting) {
  switch (setting) {
    case drivers::LinkSetting::kNone:
      break;
    case drivers::LinkSetting::kInterface:
      return ".interface";
    case drivers::LinkSetting::kEthertype:
      return ".ethertype";
    case drivers::LinkSetting::kAddress:
      return ".address";
    case drivers::LinkSetting::kPort:
      return ".port";
    case drivers::LinkSetting::kCapture:
      return ".file";
    case drivers::LinkSetting::kOutput:
      return ".output";
    case drivers::LinkSetting::kDownlink:
      return ".downlink";
    case drivers::LinkSetting::kUplink:
      return ".uplink";
  }
  return "";
}

}  // namespace

drivers::PacerConfig pacing_of(const LinkConfig& config) {
  drivers::PacerConfig pacing{config.rate_hz, config.burst_frames,
                              std::chrono::microseconds(config.jitter_us), std::nullopt};
  if (config.forward_jitter_us) {
    pacing.max_forward_jitter = std::chrono::microseconds(*config.forward_jitter_us);
  }
  return pacing;
}

std::unique_ptr<drivers::Link> open_link(boost::asio::io_context& io, const LinkConfig& config,
                                         const KeyLines& lines, frame::ProfileId profile,
                                         std::size_t max_packet_bytes) {
  const std::string section = "links." + config.name;
  try {
    return open(io, config, profile, max_packet_bytes);
  } catch (const drivers::LinkError& error) {
    throw lines.error(section + key_of(error.blamed()), error.what());
  } catch (const std::exception& error) {
    throw lines.error(section, error.what());
  }
}

}  // namespace swarmtalk::daemon
