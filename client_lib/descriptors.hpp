// Where a program has closed descriptors 0 to 2, ours must not take their place: what the program
// prints would go to the daemon.
#pragma once

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

namespace swarmtalk::client {

/// @param fd  just opened, close-on-exec; -1 with errno: it failed
/// @return the same as a descriptor from 3 on; -1 with errno: none is left
inline int above_standard_streams(int fd) {
  if (fd < 0 || fd > STDERR_FILENO) return fd;
  const int moved = ::fcntl(fd, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int error = errno;
  ::close(fd);
  errno = error;
  return moved;
}

}  // namespace swarmtalk::client
