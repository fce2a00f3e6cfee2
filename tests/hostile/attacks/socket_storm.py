"""A program of the group that does all it can think of with connections of its own, from a seed:
requests right and wrong, cut and glued, answers that nobody reads, descriptors passed along,
connections dropped in the middle. Prints how many connections and requests that were.

socket_storm.py SOCKET SECONDS SEED"""
import json
import random
import socket
import sys
import time

from local_client import Client, field, frame

REQUESTS = (5, 6, 7, 8, 10, 11, 14, 16, 17, 19, 20, 30, 40, 44, 60, 62, 64, 65, 67, 69)


def value(chance):
    """What may stand in a field of a request."""
    return chance.choice([
        0, 1, 255, 2**32 - 1, 2**64 - 1, "flood", "\u202e\u009b2J", b"\xff\xfe", b"", "x" * 65,
        chance.randbytes(chance.randrange(60)), field(1, "flood"), field(1, chance.randrange(9)),
        field(1, field(1, "flood")) + field(2, chance.randrange(2000))])


def request(chance):
    """A request with some fields, most of which have the right number."""
    body = b"".join(field(chance.randrange(1, 9), value(chance))
                    for _ in range(chance.randrange(5)))
    made = frame(field(1, chance.randrange(2**32)) + field(chance.choice(REQUESTS), body))
    damage = chance.random()
    if damage < 0.05:
        return made[:chance.randrange(len(made))] + chance.randbytes(3)
    if damage < 0.1:
        at = chance.randrange(len(made))
        return made[:at] + bytes([chance.randrange(256)]) + made[at + 1:]
    return made


def publish(chance, client):
    """Honest use, more or less, so that there is something to break."""
    publisher = client.advertise("flood", queue=chance.choice([0, 1, 64]),
                                 copies=chance.choice([1, 3]))
    if isinstance(publisher, int):
        client.socket.sendall(b"".join(
            frame(field(11, field(1, publisher) + field(2, number) +
                        field(3, chance.randbytes(chance.choice([0, 24, 3000, 16384])))))
            for number in range(1, chance.choice([2, 40]))))
    client.subscribe("flood", keep_last=chance.choice([1, 100]))


def visit(path, chance):
    """One connection. @return how many requests it made"""
    client = Client(path, name=f"storm {chance.choice(['', chr(0x202e), 'x' * 80])}",
                    says_hello=chance.random() < 0.95)
    client.socket.settimeout(2)
    made = 0
    try:
        for _ in range(chance.randrange(1, 8)):
            act = chance.random()
            if act < 0.3:
                publish(chance, client)
            elif act < 0.4:
                socket.send_fds(client.socket, [request(chance)], [client.socket.fileno(), 0])
            else:
                batch = [request(chance) for _ in range(chance.choice([1, 10, 200]))]
                client.socket.sendall(b"".join(batch))
                made += len(batch)
                if chance.random() < 0.5:
                    client.socket.recv(chance.choice([1, 65536]))
    except (OSError, EOFError, ValueError, IndexError, KeyError):
        pass  # the daemon has hung up, or waits for us
    if chance.random() < 0.3:
        client.socket.shutdown(chance.choice([socket.SHUT_RD, socket.SHUT_WR]))
        return made, client  # and stays
    client.socket.close()
    return made, None


if __name__ == "__main__":
    CHANCE = random.Random(int(sys.argv[3]))
    END = time.monotonic() + float(sys.argv[2])
    KEPT, DONE, MADE, REFUSED = [], 0, 0, 0
    while time.monotonic() < END:
        try:
            requests, kept = visit(sys.argv[1], CHANCE)
        except OSError:  # no place
            REFUSED += 1
            kept, requests = None, 0
            time.sleep(0.01)
        DONE += 1
        MADE += requests
        if kept is not None:
            KEPT.append(kept)
        while len(KEPT) > 20:
            KEPT.pop(CHANCE.randrange(len(KEPT))).socket.close()
    print(json.dumps({"connections": DONE, "requests": MADE, "refused": REFUSED}))
