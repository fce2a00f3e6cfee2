// The two clocks of the daemon, its drivers, the bridge and the client library: nothing else in
// them asks for the time. A test that turns the time itself links its own clock in place of this,
// and its own timer.
#pragma once

#include <chrono>

namespace swarmtalk::loop {

/// CLOCK_MONOTONIC: what waits, ages and paces goes by it.
std::chrono::steady_clock::time_point now();

/// CLOCK_REALTIME, which somebody may set: only for stamps that go to people or into files, and to
/// understand the kernel's.
std::chrono::system_clock::time_point wall_now();

}  // namespace swarmtalk::loop
