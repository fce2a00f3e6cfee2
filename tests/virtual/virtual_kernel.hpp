// What the kernel does to the frames of a virtual swarm: each has the wall clock at which it came
// as its receive stamp, and a socket may refuse to send.
#pragma once

namespace swarmtalk::test {

/// From now on sending by this socket fails with this errno. 0: it does not.
void refuse_frames(int socket, int error);

}  // namespace swarmtalk::test
