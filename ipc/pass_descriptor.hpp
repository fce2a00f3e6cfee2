// A descriptor beside bytes on a Unix stream socket (SCM_RIGHTS). Used by daemon and client_lib.
#pragma once

#include <sys/types.h>

#include <cstddef>

namespace swarmtalk::ipc {

/// As send() with MSG_NOSIGNAL and MSG_DONTWAIT; the other process gets a copy of `descriptor` with
/// the first byte. @return as send()
ssize_t send_with_descriptor(int socket, const void* bytes, std::size_t size, int descriptor);

/// As recv(). @param descriptor  set to one that came with these bytes, now ours; else left alone
ssize_t receive_with_descriptor(int socket, void* bytes, std::size_t size, int& descriptor);

}  // namespace swarmtalk::ipc
