"""Takes pages out of a ring's memory and wakes the daemon, which would make new ones at its own
cost.
Prints how often that went well, and whether a ring is offered after it.

punch_rings.py SOCKET TIMES"""
import ctypes
import json
import os
import socket
import sys

from local_client import Client

PUNCH_HOLE = 3  # FALLOC_FL_PUNCH_HOLE | FALLOC_FL_KEEP_SIZE
BELL = b"\xb7"
LIBC = ctypes.CDLL(None, use_errno=True)


def begin(path):
    """@return the connection, and the descriptor of its ring's memory or none"""
    client = Client(path, features=["ring"])
    client.received, descriptors, _, _ = socket.recv_fds(client.socket, 65536, 1)
    return client, descriptors[0] if descriptors else None


def punch(client, memory, times):
    """@return how often, before the daemon hung up"""
    size = ctypes.c_long(os.fstat(memory).st_size)
    for done in range(times):
        assert LIBC.fallocate(memory, PUNCH_HOLE, ctypes.c_long(0), size) == 0
        try:
            client.socket.sendall(BELL)
            if client.socket.recv(1, socket.MSG_PEEK if done + 1 == times else 0):
                return done + 1  # told that it is malformed
        except OSError:
            return done + 1
    return times


if __name__ == "__main__":
    CLIENT, MEMORY = begin(sys.argv[1])
    CLIENT.take()
    CLIENT.socket.settimeout(60)
    TIMES = punch(CLIENT, MEMORY, int(sys.argv[2]))
    _, AGAIN = begin(sys.argv[1])
    print(json.dumps({"times": TIMES, "offered_again": AGAIN is not None}))
