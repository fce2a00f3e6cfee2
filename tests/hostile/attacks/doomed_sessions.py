"""Connections without a process: their answers are unread, then comes a malformed frame, then the
connection's own descriptor, which waits in the daemon's queue and keeps it open; then kill -9.

doomed_sessions.py SOCKET COUNT"""
import array
import os
import signal
import socket
import sys

from local_client import GET_STATUS, Client, field, frame, wait_for

AT_ONCE, BATCHES = 16, 200


def fill(client):
    """Asks until the kernel's buffer takes no more answers."""
    for _ in range(BATCHES):
        before = client.unread_by_us()
        client.socket.sendall(AT_ONCE * frame(field(1, 1) + field(GET_STATUS, b"")))
        wait_for(lambda: client.unread_by_daemon() == 0, "the requests to be read")
        Client(sys.argv[1]).answer(None)  # the daemon has had a turn since
        if client.unread_by_us() == before:
            return
    raise RuntimeError("the daemon's answers never fill its buffer")


def doom(path):
    client = Client(path)
    fill(client)
    client.socket.sendall(frame(b""))
    wait_for(lambda: client.unread_by_daemon() == 0, "the malformed frame to be read")
    own = array.array("i", [client.socket.fileno()])
    try:
        client.socket.sendmsg([b"x"], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, own)])
    except (BrokenPipeError, ConnectionResetError):
        pass  # it has hung up, as it should
    return client


if __name__ == "__main__":
    KEPT = [doom(sys.argv[1]) for _ in range(int(sys.argv[2]))]
    os.kill(os.getpid(), signal.SIGKILL)
