// One TCP connection: an HTTP request for the page, or a WebSocket with a Viewer behind it.
// connection.cpp is the only place that knows Boost.Beast.
#pragma once

#include <boost/asio/ip/tcp.hpp>

namespace swarmtalk::view {

class Server;

/// Takes the connection on; it ends by itself, or when the server closes it. The server outlives
/// it.
void serve(boost::asio::ip::tcp::socket socket, Server& server);

}  // namespace swarmtalk::view
