// What client and daemon say to each other first, and what of it is wrong.
#pragma once

#include <string>

#include <swarmtalk/client/status.hpp>

#include "ipc/ipc.pb.h"

namespace swarmtalk::client {

/// The client's greeting.
void fill_hello(ipc::Hello& hello, const std::string& name);

/// Whether a client can bear this name. @return kBadArgument: it is not UTF-8, or too long
Status check_name(const std::string& name);

/// Whether this is a daemon's greeting that we can go on from. @param path  of the socket, for
/// people
/// @return the daemon's refusal; kProtocol; kVersionMismatch
Status check_greeting(const ipc::Envelope& envelope, const std::string& path);

}  // namespace swarmtalk::client
