// Makes the station of one [links.NAME] section: a node of the section's profile on its link.
#pragma once

#include <boost/asio/io_context.hpp>
#include <functional>
#include <memory>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/station/node_identity.hpp"
#include "daemon/station/station.hpp"
#include "drivers/link/link.hpp"

namespace swarmtalk::daemon {

/// As open_link().
using LinkOpener = std::function<std::unique_ptr<drivers::Link>(
    boost::asio::io_context& io, const LinkConfig& config, const KeyLines& lines,
    frame::ProfileId profile, std::size_t max_packet_bytes)>;

/// All references must outlive the station, which is not started.
/// @throws ConfigError  naming the key that the driver refuses and why
std::unique_ptr<Station> make_station(boost::asio::io_context& io, const LinkConfig& config,
                                      const KeyLines& lines, NodeIdentity& identity,
                                      const PoseKeeper& poses, StationUser& user,
                                      const LinkOpener& open);

/// One link that can start is enough: the others come up when what they miss is there.
/// @throws ConfigError  there is none: what the first one misses
void expect_one_to_start(const std::vector<std::unique_ptr<Station>>& stations,
                         const KeyLines& lines);

}  // namespace swarmtalk::daemon
