// The stream between a program and the daemon, which is a Unix socket. A library of its own, so
// that a test's takes its place: one that cuts what is read and written where it likes, or that
// leads to a daemon in the same process. Any thread.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace swarmtalk::ipc {

/// Connects a Unix socket to the one at `path`; one that does not block waits for nothing.
/// @param path  short enough for sockaddr_un
/// @return 0, or the errno of connect()
int connect_stream(int fd, const std::string& path);

/// Reads what is there, and waits for nothing.
/// @return bytes; 0: the other side has ended its own; -1 with errno, EAGAIN: nothing is there
ssize_t read_stream(int fd, std::span<std::uint8_t> room);

/// Writes what there is room for, and waits for nothing. No SIGPIPE.
/// @return bytes; -1 with errno, EAGAIN: there is no room
ssize_t write_stream(int fd, std::string_view bytes);

}  // namespace swarmtalk::ipc
