"""Takes a ring on one connection after the other and keeps its memory when the connection is
closed; each process that connects passes the memory on to its parent and ends. Prints how much is
kept.

keep_rings.py SOCKET CONNECTIONS PROCESSES"""
import array
import json
import os
import resource
import socket
import sys

from local_client import Client

MOST_AT_ONCE = 200  # descriptors in one message; the kernel takes 253


def connect(path, count):
    """@return descriptors of the rings' memory"""
    kept = []
    for _ in range(count):
        client = Client(path, features=["ring"])
        _, descriptors, _, _ = socket.recv_fds(client.socket, 65536, 1)
        kept += descriptors
        client.socket.close()
    return kept


def from_a_child(path, count):
    ours, theirs = socket.socketpair()
    child = os.fork()
    if child == 0:
        socket.send_fds(theirs, [b"x"], connect(path, count))
        os._exit(0)
    _, descriptors, _, _ = socket.recv_fds(ours, 1, MOST_AT_ONCE)
    os.waitpid(child, 0)
    ours.close()
    theirs.close()
    return descriptors


if __name__ == "__main__":
    HARD = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    resource.setrlimit(resource.RLIMIT_NOFILE, (HARD, HARD))
    EACH = int(sys.argv[2]) // int(sys.argv[3])
    KEPT = array.array("i")
    for _ in range(int(sys.argv[3])):
        KEPT.extend(from_a_child(sys.argv[1], min(EACH, MOST_AT_ONCE)))
    FILES = {os.fstat(each).st_ino: os.fstat(each).st_blocks // 2 for each in KEPT}
    print(json.dumps({"passed": len(KEPT), "files": len(FILES), "kib": sum(FILES.values())}),
          flush=True)
    sys.stdin.read()
