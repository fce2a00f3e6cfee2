// Gives up, for good, everything that a compromised daemon could use.
#pragma once

namespace swarmtalk::daemon {

/// Call once, single-threaded, when all sockets that need a privilege are open. Afterwards the
/// process has no capability (effective, permitted, inheritable, ambient) and can gain none
/// (no_new_privs). The bounding set is emptied too where that is allowed (CAP_SETPCAP): without
/// it no_new_privs has the same effect.
/// @throws std::runtime_error  it did not work, checked against the kernel: do not go on
void drop_privileges();

/// From now on no other process of this user can read this one's memory, and none of it gets into a
/// file when it dies: for a process that holds a key. After drop_privileges().
void forbid_dumps();

}  // namespace swarmtalk::daemon
