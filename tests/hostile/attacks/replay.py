"""Records what is on the air, and plays it again. Reads commands, a line each, and answers each
with a line: "stop" ends recording, "play" sends all that was recorded in a random order, "order" as
it came."""
import socket
import sys
import threading

import frames


def record(interface, into, until):
    listener = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(frames.ETHERTYPE))
    listener.bind((interface, frames.ETHERTYPE))
    listener.settimeout(0.05)
    while not until.is_set():
        try:
            frame, address = listener.recvfrom(65536)
        except socket.timeout:
            continue
        if address[2] != socket.PACKET_OUTGOING:
            into.append(frame)


def main():
    parser = frames.parser(__doc__)
    options = parser.parse_args()
    draws = frames.draws(options)
    recorded, ended = [], threading.Event()
    recorder = threading.Thread(target=record, args=(options.interface, recorded, ended))
    recorder.start()
    sender = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)
    sender.bind((options.interface, 0))
    for line in sys.stdin:
        command = line.strip()
        if command == "stop":
            ended.set()
            recorder.join()
        else:
            options.seconds = len(recorded) / options.rate
            order = list(recorded)
            if command == "play":
                draws.shuffle(order)
            for count in frames.paced(options):
                sender.send(order[count])
        print(len(recorded), flush=True)
    ended.set()
    recorder.join()


main()
