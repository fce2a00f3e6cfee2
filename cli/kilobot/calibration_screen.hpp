// The live screen of `swarmtalk-cli kilobot calibrate`: each change of a duty is sent at once, and
// the robot in the light moves with it.
#pragma once

#include <csignal>
#include <string>

#include "cli/common/daemon_requests.hpp"

namespace swarmtalk::cli {

/// Runs until a key or a signal ends it; a robot that was told to move is paused.
/// @param link  empty: the only one
/// @param signal  becomes its number when one comes
/// @return exit code
int calibrate_on_screen(DaemonRequests& daemon, const std::string& link,
                        const volatile std::sig_atomic_t& signal);

}  // namespace swarmtalk::cli
