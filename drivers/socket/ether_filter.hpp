// The kernel's filter on a packet socket: frames of one EtherType and nothing else, for good.
#pragma once

#include <cstdint>

namespace swarmtalk::drivers {

/// Attaches the filter "ether proto ETHERTYPE", compiled by libpcap, to a SOCK_RAW packet socket,
/// and locks it: from then on the socket cannot be made to hear anything else, also not by a
/// process that has been taken over and binds it elsewhere.
/// @throws std::runtime_error
void attach_locked_ether_filter(int packet_socket, std::uint16_t ethertype);

}  // namespace swarmtalk::drivers
