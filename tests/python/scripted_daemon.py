"""A daemon that is a script in the thread of the client it serves, and a clock that stands still
unless the client waits. The bytes are looked at with the protocol of docs/ipc.md, by hand."""
import select
import socket

import swarmtalk
from local_frames import field, fields, frame, next_envelope

HELLO, FAILURE, DONE, SUBSCRIBE, SUBSCRIBED, UNSUBSCRIBE = range(2, 8)
ADVERTISE, ADVERTISED, UNADVERTISE = range(8, 11)
PUBLISH, SENT, DELIVER, GET_STATUS, STATUS, SET_POSE, GET_POSE, POSE, CLIENT_LOSS = range(11, 20)
GREETING = field(1, swarmtalk._MAJOR) + field(2, 0) + field(4, "swarmtalkd 9") + field(5, 77)


def advertised(max_bytes=10, max_ttl=3):
    """The answer to a publisher; its id is the request's number."""
    return lambda number: field(ADVERTISED, field(1, number) + field(2, 5) + field(3, max_bytes)
                                + field(4, max_ttl))


class Script:
    """The other end of the socket. What it has got is in `requests`: [(kind, its fields)]."""

    def __init__(self, path):
        self.path = path
        self.listening, self.connection = None, None
        self.requests, self.received, self.attempts = [], b"", 0
        self.answers = {ADVERTISE: lambda number: field(ADVERTISED, field(1, number) + field(2, 5)),
                        SUBSCRIBE: lambda number: field(SUBSCRIBED, field(1, number) + field(2, 5))}
        self.greeting = field(HELLO, GREETING)

    def start(self):
        self.path.unlink(missing_ok=True)
        self.listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.listening.bind(str(self.path))
        self.listening.listen(8)
        self.listening.setblocking(False)

    def stop(self):
        for each in (self.connection, self.listening):
            if each is not None:
                each.close()
        self.connection = self.listening = None
        self.path.unlink(missing_ok=True)

    def drop(self):
        """Ends the connection; the next one is taken."""
        self.connection.close()
        self.connection = None

    def serve(self):
        """Takes a connection, reads and answers what has come. Returns whether there was any."""
        did = False
        if self.connection is None and self.listening is not None:
            try:
                self.connection, _ = self.listening.accept()
            except BlockingIOError:
                return False
            self.connection.setblocking(False)
            self.received, did = b"", True
            self.attempts += 1
        while self.connection is not None:
            try:
                envelope, self.received = next_envelope(self.received, self.more)
            except BlockingIOError:
                break
            except EOFError:
                self.drop()
                break
            did = True
            self.take(fields(envelope))
        return did

    def more(self):
        try:
            chunk = self.connection.recv(65536)
        except BlockingIOError:
            raise
        except OSError:
            return b""
        self.received += chunk  # kept when the next look finds nothing
        return chunk

    def take(self, told):
        (kind,) = set(told) - {1}
        self.requests.append((kind, told.get(1), fields(told[kind])))
        if kind == HELLO and self.greeting:
            self.tell(self.greeting)
        elif kind in self.answers and 1 in told:
            self.tell(field(1, told[1]) + self.answers[kind](told[1]))

    def tell(self, *envelopes):
        self.connection.sendall(b"".join(map(frame, envelopes)))

    def deliver(self, subscriber, data):
        self.tell(field(DELIVER, field(1, subscriber) + field(2, data)))

    def of(self, kind):
        return [each[2] for each in self.requests if each[0] == kind]

    def poses(self):
        """x of each pose that it was told, of fields that are little-endian floats."""
        return [swarmtalk.struct.unpack("<f", each[1])[0] for each in self.of(SET_POSE)]

    def newest_id(self, kind):
        """The id of the newest request of a kind: of a subscription, too."""
        return [each[1] for each in self.requests if each[0] == kind][-1]


class World:
    """A client, its daemon and the time, which goes on only when it is told to, or when the client
    waits and nothing comes."""

    def __init__(self, monkeypatch, path):
        self.now, self.daemon = 1000.0, Script(path)
        self.told, self.heard = [], []
        monkeypatch.setattr(swarmtalk, "_monotonic", lambda: self.now)
        monkeypatch.setattr(swarmtalk, "_set_timer", lambda descriptor, seconds: None)
        monkeypatch.setattr(swarmtalk, "_interruptible", self.wait)
        self.client = swarmtalk.Client("test", path, connect=False)
        self.client.on_error = lambda error: self.told.append(("error", error.code, error.text))
        self.client.on_disconnect = lambda error: self.told.append(("lost", error.text))
        self.client.on_reconnect = lambda: self.told.append(("back",))

    def wait(self, poll, timeout):
        found = poll(0)
        if not self.daemon.serve() and not found and timeout:
            self.now += 0.001
        return found

    def settle(self):
        """Until neither has more to say. As in an event loop, the client does what it has to when
        its descriptor is readable."""
        for _ in range(1000):
            is_due = self.client._timer_at is not None and self.client._timer_at <= self.now
            readable = select.select([self.client.fileno()], [], [], 0)[0]
            if is_due or readable:
                self.client.process()
            if not self.daemon.serve() and not readable:
                return
        raise AssertionError("they never come to an end")

    def pass_time(self, seconds, each=None, step=0.001):
        for _ in range(round(seconds / step)):
            self.now += step
            self.settle()
            if each:
                each()

    def meet(self):
        self.daemon.start()
        self.pass_time(0.3)
        assert self.client.connected
