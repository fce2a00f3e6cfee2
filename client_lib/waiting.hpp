// How the client library waits: for descriptors, and for a time by a descriptor. A library of its
// own, so that a test's takes its place, whose waits turn the clock.
#pragma once

#include <poll.h>

#include <chrono>
#include <span>

namespace swarmtalk::client {

using WaitTime = std::chrono::steady_clock::time_point;

/// A descriptor that is readable from the time that it is set to until it is set again or cleared.
/// @return -1 with errno: none is left
int make_timer();
void set_timer(int timer, WaitTime time);
void clear_timer(int timer);
void close_timer(int timer);

/// Waits until one is ready, at most until `deadline`; a signal may end the wait.
/// @return false: none is
bool wait_for(std::span<pollfd> descriptors, WaitTime deadline);
/// The same for what an epoll instance watches, which it leaves there.
bool wait_for_epoll(int epoll, WaitTime deadline);

}  // namespace swarmtalk::client
