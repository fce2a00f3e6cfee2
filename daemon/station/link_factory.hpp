// Opens the link of one [links.NAME] section.
#pragma once

#include <boost/asio/io_context.hpp>
#include <memory>

#include "daemon/config/config.hpp"
#include "daemon/config/config_error.hpp"
#include "drivers/link/link.hpp"

namespace swarmtalk::daemon {

/// How fast a link may transmit.
drivers::PacerConfig pacing_of(const LinkConfig& config);

/// @param max_packet_bytes  the profile's MTU
/// @throws ConfigError  naming the key that the driver refuses and why
std::unique_ptr<drivers::Link> open_link(boost::asio::io_context& io, const LinkConfig& config,
                                         const KeyLines& lines, frame::ProfileId profile,
                                         std::size_t max_packet_bytes);

}  // namespace swarmtalk::daemon
