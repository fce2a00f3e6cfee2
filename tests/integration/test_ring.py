"""The ring of the local protocol, used from another language by who has read docs/ipc.md only."""
import contextlib
import mmap
import os
import pathlib
import random
import resource
import signal
import socket
import struct
import subprocess
import sys

import pytest
from conftest import program, udp_port, wait_for

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
from local_frames import field, fields, frame, next_envelope  # noqa: E402

# Offsets in the shared memory.
WRITTEN, READ, WRITER_WAITS, WRITER_LEFT, BYTES = 0, 64, 192, 256, 4096
BELL = b"\xb7"

pytestmark = pytest.mark.logic  # a daemon alone, and its clients here


class RingClient:
    """Says hello, takes the ring, and writes everything through it. It has no memory barriers, so
    it rings the bell after every write."""

    def __init__(self, path: pathlib.Path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(60)
        self.socket.connect(str(path))
        hello = field(1, 1) + field(3, "ring") + field(4, "python")
        self.socket.sendall(frame(field(2, hello)))
        self.received, descriptors, _, _ = socket.recv_fds(self.socket, 65536, 1)
        assert fields(fields(self.take())[2])[3] == b"ring"
        size = os.fstat(descriptors[0]).st_size
        self.memory = mmap.mmap(descriptors[0], size)
        os.close(descriptors[0])
        self.words = memoryview(self.memory).cast("I")  # whole words: struct writes byte by byte
        self.size = size - BYTES
        self.written = 0
        self.waits = 0
        self.when_full = lambda: None
        self.requests = 0
        self.unread = []  # frames that came before an awaited one

    def get(self, offset: int) -> int:
        return self.words[offset // 4]

    def set(self, offset: int, value: int):
        self.words[offset // 4] = value

    def room(self) -> int:
        return self.size - ((self.written - self.get(READ)) & 0xFFFFFFFF)

    def write(self, data: bytes):
        while data:
            count = min(self.room(), len(data))
            begin = self.written % self.size
            first = min(count, self.size - begin)
            self.memory[BYTES + begin:BYTES + begin + first] = data[:first]
            self.memory[BYTES:BYTES + count - first] = data[first:count]
            self.written = (self.written + count) & 0xFFFFFFFF
            self.set(WRITTEN, self.written)
            data = data[count:]
            if data:
                self.set(WRITER_WAITS, 1)
            self.socket.sendall(BELL)
            if data and self.room() == 0:
                self.waits += 1
                self.when_full()
                self.unread.append(self.find(20))  # room

    def take(self) -> bytes:
        while True:
            if len(self.received) >= 4:
                end = 4 + struct.unpack_from("<I", self.received)[0]
                if len(self.received) >= end:
                    envelope, self.received = self.received[4:end], self.received[end:]
                    return envelope
            more = self.socket.recv(65536)
            if not more:
                raise EOFError
            self.received += more

    def find(self, number: int) -> dict:
        """The next envelope that has this submessage; others are kept."""
        for at, envelope in enumerate(self.unread):
            if number in envelope:
                return self.unread.pop(at)
        while True:
            envelope = fields(self.take())
            if number in envelope:
                return envelope
            self.unread.append(envelope)

    def ask(self, body: bytes, reply: int) -> dict:
        self.requests += 1
        self.write(frame(field(1, self.requests) + body))
        envelope = self.find(reply)
        assert envelope[1] == self.requests
        return fields(envelope[reply])

    def close(self):
        self.set(WRITER_LEFT, 1)
        self.socket.close()
        self.words.release()
        self.memory.close()


@contextlib.contextmanager
def a_daemon(tmp_path, **spawn):
    """A daemon whose rings are as small as they may be: its pid and its socket's path."""
    config, path, log = tmp_path / "d.toml", tmp_path / "d.sock", tmp_path / "log"
    port = udp_port()
    config.write_text(f'[links.w]\ntype = "udp"\ninterface = "lo"\nport = {port}\n'
                      '[limits]\nring_bytes = 4096\n')
    with open(log, "w", encoding="utf-8") as out:
        process = subprocess.Popen([program("swarmtalkd"), "--config", config, "--socket", path],
                                   stderr=out, **spawn)
    wait_for(lambda: "serves" in log.read_text() or process.poll() is not None, what="start")
    yield process.pid, path
    process.terminate()
    assert process.wait(60) == 0


@pytest.fixture
def daemon(tmp_path):
    with a_daemon(tmp_path) as running:
        yield running


def test_messages_through_the_ring_arrive_as_they_were(daemon):
    pid, path = daemon
    sender, listener = RingClient(path), RingClient(path)
    listener.ask(field(5, field(1, field(1, "c")) + field(2, 100)), 6)
    publisher = sender.ask(field(8, field(1, field(1, "c")) + field(4, 100)), 9)[1]
    chance = random.Random(3)
    sizes = [chance.randrange(1, 600) for _ in range(60)] + [16000, 1, 9000]  # longer than a ring
    messages = [chance.randbytes(size) for size in sizes]
    # The daemon may read as fast as this writes: it stands still until the ring is full.
    sender.when_full = lambda: os.kill(pid, signal.SIGCONT)
    for number, message in enumerate(messages, start=1):
        if len(message) == 16000:
            os.kill(pid, signal.SIGSTOP)
            os.waitid(os.P_PID, pid, os.WSTOPPED)
        body = field(1, publisher) + field(2, number) + field(3, message)
        sender.write(frame(field(11, body)))
    assert [fields(listener.find(13)[13])[2] for _ in messages] == messages
    for number in range(1, len(messages) + 1):
        assert fields(sender.find(12)[12])[2] == number
    assert sender.waits > 0
    sender.close()
    listener.close()


def test_rings_of_clients_that_leave_are_used_again(daemon):
    pid, path = daemon
    proc = pathlib.Path(f"/proc/{pid}")

    def held():
        return len(os.listdir(proc / "fd")), (proc / "maps").read_text().count("swarmtalk-ring")

    before = held()
    clients = [RingClient(path) for _ in range(10)]
    wait_for(lambda: held() == (before[0] + 20, 10), what="a socket and a memory for each")
    for client in clients:
        client.close()
    kept = before[0] + 10, 0  # the descriptors: as many as there were clients at once
    wait_for(lambda: held() == kept, what="ten to be gone: one more at once would be kept as well")
    for _ in range(200):
        client = RingClient(path)
        client.ask(field(8, field(1, field(1, "c"))), 9)
        client.close()
    wait_for(lambda: held() == kept, what="all to be gone but what is kept for the next")


def test_a_daemon_that_may_not_write_files_serves_without_rings(tmp_path):
    few = 4096  # enough for its log

    def limit():
        resource.setrlimit(resource.RLIMIT_FSIZE, (few, few))

    with a_daemon(tmp_path, preexec_fn=limit) as (_, path):
        with socket.socket(socket.AF_UNIX) as client:
            client.settimeout(60)
            client.connect(str(path))
            client.sendall(frame(field(2, field(1, 1) + field(3, "ring"))) +
                           frame(field(1, 1) + field(14, b"")))
            hello, rest = next_envelope(b"", lambda: client.recv(65536))
            assert 3 not in fields(fields(hello)[2]), "no ring is offered"
            status, _ = next_envelope(rest, lambda: client.recv(65536))
            assert fields(status)[1] == 1 and fields(status)[15], "and it serves"
