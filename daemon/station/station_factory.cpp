#include "daemon/station/station_factory.hpp"

#include <algorithm>
#include <utility>

#include "daemon/station/node_station.hpp"

namespace swarmtalk::daemon {

std::unique_ptr<Station> make_station(boost::asio::io_context& io, const LinkConfig& config,
                                      const KeyLines& lines, NodeIdentity& identity,
                                      const PoseKeeper& poses, StationUser& user,
                                      const LinkOpener& open) {
  const ProfileEntry& profile = profile_entry(config.profile);
  std::unique_ptr<drivers::Link> link =
      open(io, config, lines, profile.name.id, profile.limits.max_packet_bytes);
  const auto make = [&]<class P>() -> std::unique_ptr<Station> {
    auto station = std::make_unique<NodeStation<P>>(config.name, profile.name, std::move(link),
                                                    identity, poses, user);
    station->link().set_air_rate(config.air_rate_mbps);
    station->link().set_beacon(std::chrono::milliseconds(config.beacon_ms));
    station->set_virtual_range(config.virtual_range);
    station->set_ghosts(config.hears_ghosts);
    station->set_forwarding(config.forwarding);
    return station;
  };
  switch (config.profile) {
    case frame::ProfileId::kKilobot:
      return make.operator()<HostedKilobot>();
    case frame::ProfileId::kClassic2020:
      return make.operator()<HostedClassic2020>();
    case frame::ProfileId::kFootbot:
      return make.operator()<HostedFootbot>();
    case frame::ProfileId::kWifi:
      break;
  }
  return make.operator()<core::Wifi>();
}

void expect_one_to_start(const std::vector<std::unique_ptr<Station>>& stations,
                         const KeyLines& lines) {
  const auto can_start = [](const auto& station) { return station->link().missing().empty(); };
  if (stations.empty() || std::any_of(stations.begin(), stations.end(), can_start)) return;
  Station& first = *stations.front();
  throw lines.error("links." + first.name() + ".interface", first.link().missing());
}

}  // namespace swarmtalk::daemon
