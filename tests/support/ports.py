"""UDP ports for daemons on this machine; for Python 2.7 as well.

They are below those that the kernel gives away (from 32768), and above those of tests in C++ (up to
30000: udp_port in tests/unit/drivers/test_link_user.cpp).
"""
import fcntl
import itertools
import os
import socket

FIRST, COUNT = 30000, 2700
_next = itertools.count(os.getpid())
_held = []


def udp_port():
    """A port that udp_port gives to nobody else on this network while this process lives."""
    for number in itertools.islice(_next, COUNT):
        port = FIRST + number % COUNT
        mark = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        fcntl.fcntl(mark, fcntl.F_SETFD, fcntl.FD_CLOEXEC)
        try:
            mark.bind("\0swarmtalk-test-port-%d" % port)
        except (OSError, IOError):
            mark.close()
            continue
        _held.append(mark)
        return port
    raise RuntimeError("all ports for tests are taken")
