// Makes the station of one [links.NAME] section: its link, and a node of the section's profile.
#pragma once

#include <boost/asio/io_context.hpp>
#include <memory>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "daemon/pose/pose_keeper.hpp"
#include "daemon/station/node_identity.hpp"
#include "daemon/station/station.hpp"

namespace swarmtalk::daemon {

/// All references must outlive the station, which is not started.
/// @throws ConfigError  naming the key that the driver refuses and why
std::unique_ptr<Station> make_station(boost::asio::io_context& io, const LinkConfig& config,
                                      const KeyLines& lines, NodeIdentity& identity,
                                      const PoseKeeper& poses, StationUser& user);

}  // namespace swarmtalk::daemon
