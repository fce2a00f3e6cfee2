"""A WebSocket client of a hundred lines, of the standard library only: for swarmtalk-view and for a
browser's debugging port. Text is returned as str, binary as bytes."""
import base64
import os
import re
import socket
import struct


class Refused(Exception):
    """The server did not agree; `status` is its HTTP status, the text its answer."""

    def __init__(self, status, text):
        super().__init__(f"{status}: {text}")
        self.status = status
        self.text = text


def head_of(connection):
    """An HTTP answer up to its empty line, and what came behind it."""
    received = b""
    while b"\r\n\r\n" not in received:
        part = connection.recv(4096)
        if not part:
            break
        received += part
    head, _, rest = received.partition(b"\r\n\r\n")
    return head.decode("latin-1"), rest


def rest_of(connection, received):
    while True:
        part = connection.recv(65536)
        if not part:
            return received
        received += part


def get(port, path="/", host=None, **headers):
    """One GET; returns status, headers and body."""
    with socket.create_connection(("127.0.0.1", port), timeout=60) as connection:
        lines = [f"GET {path} HTTP/1.1", f"Host: {host or f'localhost:{port}'}"]
        lines += [f"{name}: {value}" for name, value in headers.items()]
        connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        head, body = head_of(connection)
        size = re.search(r"(?i)content-length: *(\d+)", head)  # some leave the connection open
        while size is None or len(body) < int(size.group(1)):
            part = connection.recv(65536)
            if not part:
                break
            body += part
    return int(head.split()[1]), head, body


class WebSocket:
    def __init__(self, port, path="/", protocol=None, origin=None, host=None, timeout=60,
                 address="127.0.0.1"):
        self.connection = socket.create_connection((address, port), timeout=timeout)
        lines = [f"GET {path} HTTP/1.1", f"Host: {host or f'localhost:{port}'}",
                 "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                 "Sec-WebSocket-Key: " + base64.b64encode(os.urandom(16)).decode()]
        if protocol:
            lines.append("Sec-WebSocket-Protocol: " + protocol)
        if origin:
            lines.append("Origin: " + origin)
        self.connection.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.head, self.received = head_of(self.connection)
        status = int(self.head.split()[1])
        if status != 101:
            text = rest_of(self.connection, self.received)
            self.connection.close()
            raise Refused(status, text.decode(errors="replace"))

    def _take(self, size):
        while len(self.received) < size:
            part = self.connection.recv(65536)
            if not part:
                raise EOFError("the connection was closed")
            self.received += part
        taken, self.received = self.received[:size], self.received[size:]
        return taken

    def frame(self):
        """Opcode and bytes of the next frame, put together where it comes in parts. A ping between
        the parts is answered."""
        whole = b""
        first = None
        while True:
            start, size = self._take(2)
            size &= 0x7F
            if size == 126:
                size, = struct.unpack(">H", self._take(2))
            elif size == 127:
                size, = struct.unpack(">Q", self._take(8))
            body = self._take(size)
            if first and start & 0x0F == 9:
                self.send(body, 10)
                continue
            whole += body
            first = first or start & 0x0F
            if start & 0x80:
                return first, whole

    def receive(self):
        """The next message. Pings are answered; a close raises EOFError with its reason."""
        while True:
            kind, body = self.frame()
            if kind == 1:
                return body.decode()
            if kind == 2:
                return body
            if kind == 8:
                raise EOFError(body[2:].decode())
            if kind == 9:
                self.send(body, 10)

    def send(self, message, kind=None):
        body = message.encode() if isinstance(message, str) else message
        kind = kind or (1 if isinstance(message, str) else 2)
        mask = os.urandom(4)
        if len(body) < 126:
            head = struct.pack(">BB", 0x80 | kind, 0x80 | len(body))
        elif len(body) < 65536:
            head = struct.pack(">BBH", 0x80 | kind, 0x80 | 126, len(body))
        else:
            head = struct.pack(">BBQ", 0x80 | kind, 0x80 | 127, len(body))
        whole = (mask * (len(body) // 4 + 1))[:len(body)]
        masked = int.from_bytes(body, "big") ^ int.from_bytes(whole, "big")
        self.connection.sendall(head + mask + masked.to_bytes(len(body), "big"))

    def close(self):
        self.connection.close()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()
