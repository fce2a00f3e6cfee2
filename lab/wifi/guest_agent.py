"""First program of a Wi-Fi guest behind its kernel: runs what the machine outside asks for, over
one virtio serial port, and hands back output and exit codes. Many commands at once, each a session.

On the port, both ways, frames: session (u32), kind (one byte), length (u32), then so many bytes;
all numbers big-endian. To the guest: S begins a session (JSON: argv, space, env), I is input, E its
end, K a signal for the session's process group (one byte). From it: A once (the agent is there), O
and R are output and errors, X the exit code (u32; 128 + signal) and the end of the session.

Imports little: under emulation each module costs a tenth of a second.
"""
import errno
import json
import os
import select
import signal
import struct

HEADER = struct.Struct(">IcI")
PIECE = 32768
PORT_NAME = "swarmtalk"
MAX_SESSIONS = 200


def open_port() -> int:
    """The port, by the name that QEMU gave it; there is no udev here to make a link of it."""
    base = "/sys/class/virtio-ports"
    for name in os.listdir(base):
        with open(f"{base}/{name}/name", encoding="ascii") as file:
            if file.read().strip() == PORT_NAME:
                return os.open(f"/dev/{name}", os.O_RDWR)
    raise SystemExit(f"guest: no port {PORT_NAME}")


class Session:
    def __init__(self, number, pid, descriptors):
        self.number, self.pid = number, pid
        self.input, self.output, self.errors = descriptors
        self.waiting = b""  # of its input, what the pipe did not take yet
        self.input_ends = False

    def feed(self):
        """Writes what the pipe takes. @return whether some is left"""
        try:
            while self.waiting:
                self.waiting = self.waiting[os.write(self.input, self.waiting[:PIECE]):]
        except BlockingIOError:
            return True
        except BrokenPipeError:
            self.waiting, self.input_ends = b"", True
        if self.input_ends and self.input >= 0:
            os.close(self.input)
            self.input = -1
        return False


class Agent:
    def __init__(self):
        self.port = open_port()
        self.received = b""
        self.sessions = {}
        self.poll = select.poll()
        self.poll.register(self.port, select.POLLIN)
        self.readers, self.writers = {}, {}
        self.wake, wake_end = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        signal.set_wakeup_fd(wake_end, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        self.poll.register(self.wake, select.POLLIN)

    def send(self, session: int, kind: bytes, content: bytes = b""):
        rest = memoryview(HEADER.pack(session, kind, len(content)) + content)
        while rest:
            rest = rest[os.write(self.port, rest[:PIECE]):]

    def begin(self, number: int, order: dict):
        if len(self.sessions) >= MAX_SESSIONS:
            self.refuse(number, "too many commands at once")
            return
        command = order["argv"]
        if order.get("space"):
            command = ["ip", "netns", "exec", order["space"], *command]
        near, far, mine = [], [], []
        for is_input in (True, False, False):
            read_end, write_end = os.pipe2(os.O_CLOEXEC)
            far.append(read_end if is_input else write_end)
            mine.append(write_end if is_input else read_end)
        actions = [(os.POSIX_SPAWN_DUP2, end, place) for place, end in enumerate(far)]
        try:
            pid = os.posix_spawnp(command[0], command, {**os.environ, **order.get("env", {})},
                                  file_actions=actions, setsid=True, setsigdef=[signal.SIGPIPE])
        except OSError as error:
            near = mine
            self.refuse(number, f"{command[0]}: {error.strerror}")
        for end in (*near, *far):
            os.close(end)
        if near:
            return
        for end in mine:
            os.set_blocking(end, False)
        session = Session(number, pid, mine)
        self.sessions[number] = session
        for end in mine[1:]:
            self.readers[end] = session
            self.poll.register(end, select.POLLIN)

    def refuse(self, number: int, text: str):
        self.send(number, b"R", f"guest: {text}\n".encode())
        self.send(number, b"X", struct.pack(">I", 127))

    def handle(self, number: int, kind: bytes, content: bytes):
        session = self.sessions.get(number)
        if kind == b"S":
            self.begin(number, json.loads(content))
        elif session is None:
            return  # it has just ended
        elif kind == b"K":
            try:
                os.killpg(session.pid, content[0])
            except ProcessLookupError:
                pass
        elif session.input >= 0:
            session.waiting += content
            session.input_ends |= kind == b"E"
            self.feed(session)

    def feed(self, session: Session):
        end = session.input
        if session.feed() and end not in self.writers:
            self.writers[end] = session
            self.poll.register(end, select.POLLOUT)
        elif not session.waiting and self.writers.pop(end, None):
            self.poll.unregister(end)

    def read_port(self):
        self.received += os.read(self.port, 2 * PIECE)
        while len(self.received) >= HEADER.size:
            number, kind, length = HEADER.unpack_from(self.received)
            end = HEADER.size + length
            if len(self.received) < end:
                return
            content, self.received = self.received[HEADER.size:end], self.received[end:]
            self.handle(number, kind, content)

    def read_output(self, end: int) -> bool:
        """Hands on what is there. @return whether there may be more"""
        session = self.readers[end]
        try:
            content = os.read(end, PIECE)
        except BlockingIOError:
            return False
        if content:
            self.send(session.number, b"O" if end == session.output else b"R", content)
            return True
        self.close_output(end)
        return False

    def close_output(self, end: int):
        self.readers.pop(end)
        self.poll.unregister(end)
        os.close(end)

    def reap(self):
        """Ends sessions whose process has ended; what it started in the background may live on."""
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return
            if pid == 0:
                return
            for session in [entry for entry in self.sessions.values() if entry.pid == pid]:
                self.end(session, status)

    def end(self, session: Session, status: int):
        for end in (session.output, session.errors):
            pieces = 0  # bounded: what lives on may write for ever
            while pieces < 64 and end in self.readers and self.read_output(end):
                pieces += 1
            if end in self.readers:
                self.close_output(end)
        session.waiting, session.input_ends = b"", True
        if self.writers.pop(session.input, None):
            self.poll.unregister(session.input)
        session.feed()
        del self.sessions[session.number]
        code = os.WEXITSTATUS(status) if os.WIFEXITED(status) else 128 + os.WTERMSIG(status)
        self.send(session.number, b"X", struct.pack(">I", code))

    def turn(self):
        for end, events in self.poll.poll():
            if end == self.port:
                self.read_port()
            elif end == self.wake:
                try:
                    os.read(self.wake, PIECE)
                except BlockingIOError:
                    pass
            elif end in self.readers:
                self.read_output(end)
            elif end in self.writers:
                self.feed(self.writers[end])
        self.reap()

    def serve(self):
        self.send(0, b"A")
        while True:
            try:
                self.turn()
            except OSError as error:
                if error.errno != errno.EINTR:
                    raise


if __name__ == "__main__":
    os.environ.update(PATH="/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
                      HOME="/root", LANG="C.UTF-8")
    Agent().serve()
