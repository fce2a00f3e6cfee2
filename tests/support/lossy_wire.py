"""A wire that loses frames: joins the interfaces of this namespace.

lossy_wire.py LOSS SEED INTERFACE...    Each frame that comes in on one goes out on every other, but
for a share LOSS, drawn for each by itself. Prints `ready`, runs until it is ended.
"""
import random
import select
import socket
import sys

ETH_P_ALL = 3
FRAME_BYTES = 65536


def main():
    loss, seed, names = float(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]
    draws = random.Random(seed)
    ports = []
    for name in names:
        port = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL))
        port.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        port.bind((name, ETH_P_ALL))
        ports.append(port)
    print("ready", flush=True)
    while True:
        for port in select.select(ports, [], [])[0]:
            frame, where = port.recvfrom(FRAME_BYTES)
            if where[2] == socket.PACKET_OUTGOING:
                continue
            for other in ports:
                if other is not port and draws.random() >= loss:
                    other.send(frame)


if __name__ == "__main__":
    main()
