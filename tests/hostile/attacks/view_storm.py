"""Everything against the port of swarmtalk-view, from a seed: requests that never end, garbage,
wrong tokens, foreign pages and names, WebSockets with huge, endless, unmasked and compressed
frames, floods of pings and of requests, connections that read nothing, in numbers. Prints how many
connections of each kind there were.

view_storm.py PORT SECONDS SEED [KIND ...]"""
import base64
import collections
import contextlib
import json
import os
import random
import socket
import struct
import sys
import time
import zlib

MOST_HELD = 200


def upgrade(port, more="", host=None):
    return (f"GET / HTTP/1.1\r\nHost: {host or f'localhost:{port}'}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
            f"{base64.b64encode(os.urandom(16)).decode()}\r\n{more}\r\n").encode()


def ws_frame(start, body, size=None, is_masked=True):
    """@param start  the first byte: FIN, reserved bits, opcode"""
    size = len(body) if size is None else size
    mask = 0x80 if is_masked else 0
    if size < 126:
        head = struct.pack(">BB", start, mask | size)
    elif size < 65536:
        head = struct.pack(">BBH", start, mask | 126, size)
    else:
        head = struct.pack(">BBQ", start, mask | 127, size)
    return head + (b"\0\0\0\0" if is_masked else b"") + body


def open_websocket(connection, port, more=""):
    connection.sendall(upgrade(port, more))
    connection.recv(4096)


class Storm:
    """One method for each kind of visit."""

    def __init__(self, port, chance):
        self.port, self.chance, self.refused = port, chance, 0

    def expect_refusal(self, connection):
        """Nothing comes when meanwhile the place was given to a newer connection."""
        answer = connection.recv(4096)
        self.refused += b" 403 " in answer
        assert not answer or b" 403 " in answer, answer

    def half_request(self, connection):
        request = upgrade(self.port)
        connection.sendall(request[:self.chance.randrange(1, len(request) - 2)])
        return True

    def nothing(self, connection):
        return True

    def page_unread(self, connection):
        connection.sendall(f"GET / HTTP/1.1\r\nHost: localhost:{self.port}\r\n\r\n".encode())
        return True

    def garbage(self, connection):
        connection.sendall(self.chance.randbytes(self.chance.randrange(1, 20000)))

    def headers_without_end(self, connection):
        connection.sendall(b"GET / HTTP/1.1\r\n" + b"x: y\r\n" * self.chance.randrange(5000))

    def body_that_is_announced(self, connection):
        connection.sendall(f"POST / HTTP/1.1\r\nHost: localhost:{self.port}\r\nContent-Length: "
                           f"{2**40}\r\n\r\n".encode() + b"x" * 5000)

    def wrong_token(self, connection):
        token = self.chance.randbytes(12).hex()
        connection.sendall(f"GET /?token={token} HTTP/1.1\r\nHost: evil.example\r\nAuthorization: "
                           f"Bearer {token}\r\n\r\n".encode())
        self.expect_refusal(connection)

    def foreign_page(self, connection):
        connection.sendall(upgrade(self.port, "Origin: http://evil.example\r\n"))
        self.expect_refusal(connection)

    def name_made_to_point_here(self, connection):
        connection.sendall(upgrade(self.port, host="evil.example"))
        self.expect_refusal(connection)

    def frame_of_any_size(self, connection):
        open_websocket(connection, self.port)
        size = self.chance.choice([65537, 2**31, 2**63 - 1, 2**64 - 1])
        connection.sendall(ws_frame(0x81, b"x" * 10000, size))
        return True

    def fragments_without_end(self, connection):
        open_websocket(connection, self.port)
        connection.sendall(ws_frame(0x01, b"["))
        for _ in range(200):
            connection.sendall(20 * ws_frame(
                0x00, b"" if self.chance.random() < 0.5 else b"[" * 900))
        return True

    def compressed(self, connection):
        open_websocket(connection, self.port,
                       "Sec-WebSocket-Extensions: permessage-deflate\r\n")
        connection.sendall(ws_frame(0xC1, zlib.compress(b" " * 10**7)[2:-4]))

    def unmasked(self, connection):
        open_websocket(connection, self.port)
        connection.sendall(ws_frame(0x81, b"{}", is_masked=False))

    def pings(self, connection):
        open_websocket(connection, self.port)
        connection.settimeout(0.2)
        with contextlib.suppress(OSError):
            for _ in range(100):
                connection.sendall(ws_frame(0x89, b"x" * 125) * 100)
        return True

    def requests(self, connection):
        protocol = self.chance.choice(["swarmtalk.view.v1", "foxglove.sdk.v1"])
        open_websocket(connection, self.port, f"Sec-WebSocket-Protocol: {protocol}\r\n")
        text = [{"op": "card", "robot": 1}, {"op": "watch", "channel": "chat"}, {"op": "unwatch"},
                {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]},
                {"op": "unsubscribe", "subscriptionIds": [1]},
                {"op": "watch", "channel": "x" * 999},
                {"op": "publish", "channel": "chat", "text": "x"}, {"op": "seek", "at": -1e308}]
        connection.settimeout(0.2)
        with contextlib.suppress(OSError):
            for _ in range(50):
                connection.sendall(b"".join(ws_frame(0x81, json.dumps(
                    self.chance.choice(text)).encode()) for _ in range(20)))
        return True


def main():
    port, seconds, seed = int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
    chance = random.Random(seed)
    storm = Storm(port, chance)
    kinds = sys.argv[4:] or [name for name in vars(Storm) if not name.startswith(("_", "expect"))]
    made, held, turned_away = collections.Counter(), [], 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        kind = chance.choice(kinds)
        try:
            connection = socket.create_connection(("127.0.0.1", port), timeout=2)
        except OSError:
            turned_away += 1
            continue
        stays = False
        with contextlib.suppress(OSError):
            stays = getattr(storm, kind)(connection)
        made[kind] += 1
        if stays:
            held.append(connection)
        else:
            connection.close()
        while len(held) > MOST_HELD:
            held.pop(chance.randrange(len(held))).close()
    print(json.dumps({**made, "refused": storm.refused, "turned away": turned_away}), flush=True)
    if sys.stdin.isatty() is False:
        sys.stdin.read()  # holds what it has until it is told to go


if __name__ == "__main__":
    main()
