// From protocol messages to the library's public values. Pure functions.
#pragma once

#include <optional>

#include <swarmtalk/client/daemon_status.hpp>
#include <swarmtalk/client/message.hpp>
#include <swarmtalk/client/status.hpp>

#include "ipc/ipc.pb.h"
#include "ipc/message_frames.hpp"

namespace swarmtalk::client {

/// Reuses `message`, its payload's memory too.
void convert(const ipc::DeliverFrame& deliver, Message& message);
void convert(const ipc::Neighbours& from, std::vector<Neighbour>& to);
void convert(const ipc::Status& from, DaemonStatus& to);

/// Empty when x, y or theta is missing.
std::optional<Pose> convert(const ipc::Pose& pose);

Status convert(const ipc::Failure& failure);

}  // namespace swarmtalk::client
