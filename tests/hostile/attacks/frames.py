"""Frames as a stranger makes them (docs/wire-format.md), and a socket to send them from. Nothing
here is shared with the code under test: it is what anybody with a radio could write."""
import argparse
import random
import socket
import struct
import time

ETHERTYPE = 0x88B5
PACKET_BYTES = 1400  # of the profile "wifi", with its header
HEADER_BYTES = 17
BODY_BYTES = PACKET_BYTES - HEADER_BYTES
BEACON = 0x04


def packet(node, number, channel, payload=b"", *, sequence=0, end=True, ttl=0, hops=0, size=None,
           epoch=0, crossed=False):
    """One packet of the profile "wifi"."""
    size = len(payload) if size is None else size
    return struct.pack(">HIHHBBHHB", node, number, sequence << 1 | end, channel, ttl, hops, size,
                       epoch, 0x40 if crossed else 0) + payload


def air_frame(node, epoch, count, packets=(), *, flags=0, rest=b""):
    """One air frame of the profile "wifi"."""
    body = b"".join(struct.pack(">H", len(each)) + each for each in packets) + rest
    return struct.pack(">2sBBHBBHII", b"ST", 1, flags, 18 + len(body), 0, 0, node, epoch,
                       count) + body


def beacon(node, epoch, count, last_messages):
    """A beacon. @param last_messages: pairs of channel and number"""
    rest = b"".join(struct.pack(">HI", channel, number) for channel, number in last_messages)
    return air_frame(node, epoch, count, flags=BEACON, rest=rest)


def origin(name, node=1, epoch=2, number=3):
    """What is in front of a message that crossed a gateway. @param name: bytes"""
    return struct.pack(">B", len(name)) + name + struct.pack(">HHI", node, epoch, number)


class Stranger:
    """A raw socket; each frame from the hardware address that the attack wants."""

    def __init__(self, interface):
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)
        self._socket.bind((interface, 0))

    def send(self, frame, hardware=b"\x02\x00\x00\x00\x00\x99"):
        header = b"\xff" * 6 + hardware + struct.pack(">H", ETHERTYPE)
        self._socket.send((header + frame).ljust(60, b"\0"))


def parser(description):
    """The options of every attack."""
    made = argparse.ArgumentParser(description=description)
    made.add_argument("--interface", required=True)
    made.add_argument("--seed", type=int, required=True)
    made.add_argument("--seconds", type=float, default=2.0)
    made.add_argument("--rate", type=float, default=100.0, help="frames a second")
    return made


def paced(options):
    """Counts frames at the attack's rate, until its time is over."""
    began = time.monotonic()
    for count in range(int(options.seconds * options.rate)):
        wait = began + count / options.rate - time.monotonic()
        if wait > 0:
            time.sleep(wait)
        yield count


def address(draws):
    """A new hardware address of nobody's."""
    return b"\x02" + draws.randbytes(5)


def draws(options):
    return random.Random(options.seed)
