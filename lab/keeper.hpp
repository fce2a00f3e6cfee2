// Keeper: what stays of `swarmtalk-lab up --medium radio` while the lab runs: a process that runs
// the medium as its child. The two look after each other, so that a lab whose medium, keeper or
// `run` is killed, however, is taken down: no process, interface or namespace stays.
#pragma once

#include <functional>
#include <string>

namespace swarmtalk::lab {

/// What of a lab's medium runs in a process of its own: serves until one of the signals comes that
/// are blocked when it is called. @return which
using Serve = std::function<int()>;

/// Runs `serve` as a child, in the lab called `name`, until SIGTERM. Called by the hidden command
/// `keep`. @return exit code
int keep(const std::string& name, const Serve& serve);

/// The signals by which what serves is ended: SIGTERM by whoever takes the lab down, SIGUSR1 by the
/// kernel when its keeper has gone.
void block_ending_signals();

}  // namespace swarmtalk::lab
