# -*- coding: utf-8 -*-
"""swarmtalk: robot programs in Python, connected to the swarmtalkd of their robot.

    import swarmtalk
    robot = swarmtalk.Client("my_program")
    hello = robot.advertise("hello")
    robot.subscribe("hello", lambda m: print(m.sender, m.text, m.distance))
    hello.send("good morning")
    robot.run(5)

The manual is docs/python.md, the protocol docs/ipc.md. Metres, radians and seconds everywhere.

One file on purpose: copy it to a robot and it works, with the standard library alone, on Python 2.7
and on 3.5 and later. From top to bottom: errors, the bytes of the protocol, what is handed to a
program (messages, poses), publishers and subscribers, the connection, the Client, harvest, and
what runs scripts written for Coachbots. One thread owns a Client and all it hands out; callbacks
run inside process() and run(), never elsewhere. From any thread, and from a signal's handler, may
come Publisher.send(), busy() and stop().

A handler runs in the middle of whatever its thread does, calls what it may call, and may raise, as
that of Ctrl-C does. So what changes hands does so in lines without a call, such as `del queue[0]`
and `queue += (one,)`: Python 3.10 and later let no handler in between.
"""
from __future__ import print_function

import atexit
import ctypes
import errno
import os
import random
import select
import socket
import stat
import struct
import sys
import threading
import time
import traceback
import weakref
from collections import deque, namedtuple
from functools import partial

__version__ = "0.1.0"
DEFAULT_SOCKET = "/run/swarmtalk/swarmtalkd.sock"
DEFAULT_QUEUE = 16      # messages of a publisher that wait in the daemon
MESSAGES_THAT_WAIT = 1024  # of a subscriber without a callback; then the oldest goes
UNKNOWN = float("nan")  # a distance or bearing: every comparison with it is false

_MAJOR, _MINOR = 1, 2
_FRAME_MAX = 65536
_READ_BYTES = 65536
_READS_AHEAD = 16          # of 64 KiB, before callbacks run
_EVENTS_MAX = 4096         # kept while a call waits; then the oldest message goes
_OUTGOING_MAX = 1 << 20    # then send() is refused
_UNREAD_MAX = 64  # messages, or poses, whose answers wait until the next one looks for them
_SENT_EVERY_MAX = 64
_RECONNECT_FIRST_S, _RECONNECT_MAX_S = 0.02, 0.25
_POSE_MAX_M = 32.767
_WHOLE_TURN_RAD = 6.2842   # and what rounding adds to one
_RUN_WITHIN_S = 3          # of subscribing; then a program that sends is told to run
_MANY_HANDLES = 10         # of one channel: registered in a loop, most likely
_QUIET_S = 3               # of running: then a program that listens is told when nobody is around
_NAME_MAX_BYTES = 1024
_TEXT = type(u"")

if sys.version_info[0] == 2:
    import itertools
    from itertools import imap as _map, ifilter as _filter

    class _RLock(object):
        """threading's, written in Python there, is left taken by a handler that raises within: here
        it is taken, or given back, in one call."""

        def __init__(self):
            self._lock, self._owners = threading.Lock(), []

        def acquire(self, blocking=True):
            me, owners = threading._get_ident(), self._owners
            if owners[:1] == [me]:
                owners.append(me)
            else:
                owners.extend(itertools.compress((me,), _map(self._lock.acquire, (blocking,))))
            return owners[:1] == [me]

        def release(self):
            owners = self._owners
            last = (owners.pop, self._lock.release)
            deque(_map(apply, last if len(owners) == 1 else last[:1]), 0)  # noqa: F821

        def __enter__(self):
            return self.acquire()

        def __exit__(self, *error):
            self.release()
else:
    _map, _filter, _RLock = map, filter, threading.RLock


def _take_back(queue, last):
    if queue and queue[-1] is last:
        queue.pop()


def _in_one(*steps):
    """Calls partial()s of what is written in C one after another. No handler of a signal, and no
    other thread, comes in between; before Python 3.10 it does between any two statements."""
    deque(_map(_apply, steps), 0)


_apply = partial.__call__


# ---- Errors -------------------------------------------------------------------------------------

class Error(Exception):
    """What went wrong, as a sentence with the remedy; `code` is for the program.

    Codes: busy, too_long, disconnected, no_daemon, daemon_dead, no_permission, version_mismatch,
    timeout, bad_channel, channel_conflict, limit, bad_ttl, bad_pose, unsupported, link_down,
    protocol, dropped, rate, bad_argument, system.
    """

    def __init__(self, code, text):
        Exception.__init__(self, text)
        self.code = code  # for the program
        self.text = text  # for people: a sentence with the remedy

    def __reduce__(self):  # out of another process, too
        return type(self), (self.code, self.text)


class BadArgument(Error, ValueError):
    """A call that makes no sense: over-long message, impossible TTL, pose, channel or option."""


_ARGUMENT_CODES = ("too_long", "bad_ttl", "bad_pose", "bad_channel", "bad_argument")
_CODES = {1: "version_mismatch", 2: "protocol", 3: "too_long", 4: "busy", 5: "bad_channel",
          6: "channel_conflict", 7: "limit", 8: "protocol", 9: "bad_ttl", 10: "bad_pose",
          11: "unsupported", 12: "link_down", 13: "bad_argument", 14: "dropped", 15: "rate"}


def _error(code, text):
    return (BadArgument if code in _ARGUMENT_CODES else Error)(code, text)


def _bad(text):
    return BadArgument("bad_argument", text)


class Refused(object):
    """What send() returns instead of True: false in an `if`, with `code` and `text`.

    When a message was refused because too many wait, and the program throws this away without a
    look, its owner is told on stderr, at most once a second.
    """

    __slots__ = ("_code", "_text", "_unseen", "__weakref__")

    def __init__(self, code, text):
        self._code, self._text, self._unseen = code, text, None

    def _look(self):
        if self._unseen is not None:
            self._unseen.publisher._kept.pop(id(self._unseen), None)
            self._unseen = None

    def __bool__(self):
        self._look()
        return False

    __nonzero__ = __bool__

    @property
    def code(self):
        """Why it was refused, for the program."""
        self._look()
        return self._code

    @property
    def text(self):
        """The same, for people."""
        self._look()
        return self._text

    def __repr__(self):
        return "Refused(%r, %r)" % (self.code, self.text)


class _Unseen(weakref.ref):
    """A Refused at which the program has not looked yet. What is called when that goes is no
    Python: a handler's exception would vanish in there."""

    __slots__ = ("publisher", "text")


_NOT_CONNECTED = "not connected to swarmtalkd; reconnecting"


def _is_failure(error):
    """Of a message: not that the connection was lost, which is told by itself, nor as asked."""
    return error is not None and error.code not in ("disconnected", "dropped")


def _print_error(text):
    try:
        sys.stderr.write("swarmtalk: %s\n" % text)
        sys.stderr.flush()
    except Exception:  # stderr is closed, or the interpreter ends: nobody is left to be told
        if _is_of_a_handler() and not _ending:
            raise


# ---- The clock and a timer, which Python 2 does not have ----------------------------------------

_libc = ctypes.CDLL(None, use_errno=True)
_CLOCK_MONOTONIC = 1
_timespec = ctypes.c_long * 2
_itimerspec = ctypes.c_long * 4


def _monotonic_of_libc():
    now = _timespec()
    _libc.clock_gettime(_CLOCK_MONOTONIC, ctypes.byref(now))
    return now[0] + now[1] * 1e-9


_monotonic = getattr(time, "monotonic", _monotonic_of_libc)


def _open_timer(opened):
    """Adds a descriptor that becomes readable at a time set with _set_timer(), in the same call."""
    next(_map(opened.append, _map(_libc.timerfd_create, (_CLOCK_MONOTONIC,),
                                  (os.O_NONBLOCK | 0o2000000,))))
    if opened[-1] < 0:
        del opened[-1]
        raise OSError(ctypes.get_errno(), "timerfd_create")


def _set_timer(fd, seconds):
    """Readable after so long; None: never."""
    value = _itimerspec(0, 0, 0, 0)
    if seconds is not None:
        nanoseconds = max(int(seconds * 1e9), 1)
        value[2], value[3] = divmod(nanoseconds, 10 ** 9)
    _libc.timerfd_settime(fd, 0, ctypes.byref(value), None)


# ---- The bytes of the protocol (ipc/ipc.proto) --------------------------------------------------
# A message is a sequence of fields: a varint of number * 8 + kind, then a varint (kind 0), a float
# (5), or a length and so many bytes (2).

def _varint(value):
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    out.append(value)
    return bytes(out)


def _uint(field, value):
    return _varint(field << 3) + _varint(value)


def _bytes(field, value):
    return _varint(field << 3 | 2) + _varint(len(value)) + value


def _float(field, value):
    return _varint(field << 3 | 5) + struct.pack("<f", value)


def _frame(envelope):
    if len(envelope) > _FRAME_MAX:
        raise BadArgument("too_long", "this is longer than the local protocol carries")
    return struct.pack("<I", len(envelope)) + envelope


_unpack_float = struct.Struct("<f").unpack_from
_unpack_length = struct.Struct("<I").unpack_from


def _read_varint(buf, pos):
    byte = buf[pos]
    pos += 1
    if byte < 128:
        return byte, pos
    value, shift = byte & 127, 7
    while True:
        byte = buf[pos]
        pos += 1
        value |= (byte & 127) << shift
        if byte < 128:
            return value, pos
        shift += 7
        if shift > 63:
            raise ValueError("a varint of more than ten bytes")


def _fields(buf, pos, end):
    """The fields of a message, in order: [(number, int, float or bytearray)].

    Raises ValueError, IndexError or struct.error for what is no message.
    """
    found = []
    while pos < end:
        tag = buf[pos]
        pos += 1
        if tag > 127:
            tag, pos = _read_varint(buf, pos - 1)
        kind = tag & 7
        if kind == 0:
            value = buf[pos]
            pos += 1
            if value > 127:
                value, pos = _read_varint(buf, pos - 1)
        elif kind == 2:
            size = buf[pos]
            pos += 1
            if size > 127:
                size, pos = _read_varint(buf, pos - 1)
            value = buf[pos:pos + size]
            pos += size
        elif kind == 5:
            value = _unpack_float(buf, pos)[0]
            pos += 4
        elif kind == 1:
            value = buf[pos:pos + 8]
            pos += 8
        else:
            raise ValueError("a field of an unknown kind")
        found.append((tag >> 3, value))
    if pos != end:
        raise ValueError("a field goes on past the end")
    return found


def _text(value):
    return bytes(value).decode("utf-8", "replace")


def _native(text):
    """Text as a str of this Python: for names in sentences."""
    return text if isinstance(text, str) else text.encode("utf-8")


def _is_of_a_handler():
    """Whether the exception at hand came out of a signal's handler, a function of the program's,
    and not of what was called here."""
    if sys.version_info[0] == 2:
        return False  # there sockets are Python too: it cannot be told
    place, ours, sockets = sys.exc_info()[2], globals(), vars(socket)
    while place is not None and (
            place.tb_frame.f_globals is ours or place.tb_frame.f_globals is sockets):
        place = place.tb_next
    return place is not None


def _why(number):
    """The sentence for an error of the system."""
    if number == errno.EMFILE:
        return "this program has too many files and sockets open; close some, or raise the limit " \
               "before it starts: ulimit -n 4096"
    return os.strerror(number)


def _socket_path(given):
    """The path of a socket as a str of this Python, or BadArgument."""
    path = given.__fspath__() if hasattr(given, "__fspath__") else given
    if not isinstance(path, (bytes, _TEXT)):
        raise _bad("socket_path is the path of the daemon's socket, as text, not %r" % (given,))
    try:
        if bytes is str:
            path = _native(path)
        else:
            path = os.fsdecode(path)
            os.fsencode(path)  # as connect() will
    except UnicodeError:
        raise _bad("socket_path %r cannot be the name of a file here; give it as bytes" % (given,))
    if "\0" in path:
        raise _bad("socket_path %r has a zero byte in it; give the path under [socket] of the "
                   "daemon's configuration" % (given,))
    return path


class Record(object):
    """Named values that the daemon told: neighbours, status."""

    def __init__(self, **values):
        self.__dict__.update(values)

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        known = sorted(self.__dict__)
        raise AttributeError("a %s has no %r; %s" % (
            type(self).__name__, name, _near(name, known, "it has " + ", ".join(known))))

    def __repr__(self):
        return "%s(%s)" % (type(self).__name__, ", ".join(
            "%s=%r" % item for item in sorted(self.__dict__.items())))


def _record(spec, buf, kind=Record):
    """Reads a message by its table {number: (name, conversion, default)}; a list as default means
    that the field is repeated."""
    record = kind(**{name: list(default) if isinstance(default, list) else default
                     for name, _, default in spec.values()})
    for number, value in _fields(buf, 0, len(buf)):
        if number in spec:
            name, conversion, default = spec[number]
            if isinstance(default, list):
                getattr(record, name).append(conversion(value))
            else:
                setattr(record, name, conversion(value))
    return record


# ---- What is handed to a program ----------------------------------------------------------------

Pose = namedtuple("Pose", "x y theta age")  # metres, radians, seconds
GatewayOrigin = namedtuple("GatewayOrigin", "link node message_number")


def _pose(buf):
    """None when the pose is not known."""
    told = dict(_fields(buf, 0, len(buf)))
    if 1 not in told or 2 not in told or 3 not in told:
        return None
    return Pose(told[1], told[2], told[3], told.get(4, 0) / 1000.0)


class Loss(object):
    """Messages that did not come, by the place where they were lost. False when there are none."""

    __slots__ = ("air", "kernel", "daemon", "client", "late")

    def __init__(self, air=0, kernel=0, daemon=0, client=0, late=0):
        self.air = air        # gaps in a sender's message numbers that nothing else explains
        self.kernel = kernel  # of such gaps: at most what the kernel dropped meanwhile
        self.daemon = daemon  # by the daemon: queue full, too old, no memory
        self.client = client  # in this program, which reads too slowly
        self.late = late      # told as lost before, came after all

    @property
    def total(self):
        """All that did not come."""
        return self.air + self.kernel + self.daemon + self.client

    def add(self, other):
        """Counts the other's losses here as well."""
        for place in self.__slots__:
            setattr(self, place, getattr(self, place) + getattr(other, place))

    def __bool__(self):
        return self.total + self.late != 0

    __nonzero__ = __bool__

    def __eq__(self, other):
        return isinstance(other, Loss) and all(
            getattr(self, place) == getattr(other, place) for place in self.__slots__)

    def __ne__(self, other):
        return not self == other

    __hash__ = None

    def __repr__(self):
        return "Loss(%s)" % ", ".join("%s=%d" % (p, getattr(self, p)) for p in self.__slots__)


class Message(object):
    """One message: `data` exactly as it was sent, and what was sensed when it arrived.

    `distance` (metres), `bearing` (radians, counter-clockwise from this robot's heading) and
    `sender_pose` belong to the last transmitter, which with `hops` above 0 is not `sender`.
    Unknown distance and bearing are NaN, so `m.distance < 0.5` is false for them; unknown
    poses and origins are None. `transmitter` is the last transmitter's node id; it equals
    `sender` with 0 hops, and where the packets do not tell.
    """

    __slots__ = ("data", "channel", "sender", "transmitter", "epoch", "message_number",
                 "distance", "bearing", "sender_pose", "hops", "ttl", "delay", "received_at",
                 "local", "origin", "lost_before", "_is_gap_told")

    def __init__(self, fields):
        get = dict(fields).get
        self._is_gap_told = False        # to on_gap
        self.data = bytes(get(2, b""))   # exactly as it was sent
        self.channel = get(3, 0)         # number
        self.sender = get(4, 0)          # node id of the origin
        self.transmitter = get(17, 0) or self.sender  # node id of the last transmitter
        self.message_number = get(5, 0)  # per sender, channel and epoch
        self.distance = get(6, UNKNOWN)  # metres to the last transmitter; NaN: unknown
        self.bearing = get(7, UNKNOWN)   # radians, counter-clockwise; NaN: unknown
        pose = get(8)
        # The last transmitter's Pose; None: unknown.
        self.sender_pose = None if pose is None else _pose(pose)
        self.hops = get(9, 0)            # 0: heard from the sender itself; 255: not known
        self.ttl = get(10, 0)            # hops still allowed
        delay, received = get(11), get(12)
        # Of timestamped channels: from send() to the reception here, the air left out.
        self.delay = None if delay is None else delay * 1e-6
        self.received_at = None if received is None else received * 1e-9  # CLOCK_MONOTONIC
        self.local = bool(get(13, 0))    # published on this robot, by another program
        self.epoch = get(15, 0)          # tells two runs of one sender apart
        lost, origin = get(16), get(30)
        if lost is None:
            self.lost_before = Loss()    # messages of the channel since the one before
        else:
            told = dict(_fields(lost, 0, len(lost)))
            self.lost_before = Loss(told.get(1, 0), told.get(2, 0), told.get(3, 0), 0,
                                    told.get(4, 0))
        if origin is None:
            self.origin = None           # a GatewayOrigin, of one that crossed a gateway
        else:
            told = dict(_fields(origin, 0, len(origin)))
            self.origin = GatewayOrigin(_text(told.get(1, b"")), told.get(2, 0), told.get(3, 0))

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        known = Message.__slots__[:-1] + ("text", "age", "has_distance", "has_bearing")
        raise AttributeError("a Message has no %r; %s" % (
            name, "did you mean 'data'?" if name in ("payload", "message", "bytes")
            else _near(name, known, "it has " + ", ".join(known))))

    @property
    def text(self):
        """`data` as text; bytes that are no UTF-8 become U+FFFD."""
        return self.data.decode("utf-8", "replace")

    @property
    def age(self):
        """Seconds since it was received, and before that in buffers where it is known (`delay`).
        NaN when neither is known."""
        if self.received_at is None:
            return UNKNOWN
        return _monotonic() - self.received_at + (self.delay or 0)

    @property
    def has_distance(self):
        """Whether the distance is known."""
        return self.distance == self.distance

    @property
    def has_bearing(self):
        """Whether the bearing is known."""
        return self.bearing == self.bearing

    def __repr__(self):
        return "Message(%r, sender=%d, distance=%.2f)" % (self.data, self.sender, self.distance)


class Neighbour(Record):
    """A robot heard within the last 10 s."""


def _milliseconds(value):
    return value / 1000.0


def _same(value):
    return value


_NEIGHBOUR = {
    1: ("link", _text, u""), 2: ("node_id", _same, 0), 3: ("epoch", _same, 0),
    4: ("address", _text, u""), 5: ("age", _milliseconds, 0.0),
    6: ("distance", _same, UNKNOWN), 7: ("bearing", _same, UNKNOWN), 8: ("pose", _pose, None),
    9: ("frames", _same, 0), 10: ("frames_lost", _same, 0), 11: ("loss", _same, 0.0),
    12: ("duplicate_id", bool, False), 13: ("out_of_range", bool, False),
    31: ("ghost", bool, False)}


def _counter(buf):
    told = dict(_fields(buf, 0, len(buf)))
    return _text(told.get(1, b"")), told.get(2, 0)


_LINK = {
    1: ("name", _text, u""), 2: ("type", _text, u""), 3: ("device", _text, u""),
    4: ("up", bool, False), 5: ("state", _text, u""), 6: ("mtu_bytes", _same, 0),
    7: ("max_message_bytes", _same, 0), 8: ("counters", _counter, []),
    9: ("profile", _text, u""), 10: ("max_ttl", _same, 0), 30: ("node_id", _same, 0),
    31: ("max_channel", _same, 0)}
_CHANNEL = {
    1: ("number", _same, 0), 2: ("name", _text, u""), 3: ("publishers", _same, 0),
    4: ("subscribers", _same, 0), 5: ("timestamped", bool, False), 6: ("received", _same, 0),
    7: ("lost_air", _same, 0), 8: ("lost_kernel", _same, 0), 9: ("lost_daemon", _same, 0),
    10: ("late", _same, 0), 11: ("onlookers", _same, 0), 12: ("refused", _same, 0),
    30: ("links", _text, [])}
_PROGRAM = {
    1: ("name", _text, u""), 2: ("pid", _same, 0), 3: ("uid", _same, 0),
    4: ("subscriptions", _same, 0), 5: ("publishers", _same, 0), 6: ("queued_messages", _same, 0),
    7: ("queued_bytes", _same, 0), 8: ("deliveries_sent", _same, 0), 9: ("lost_daemon", _same, 0),
    10: ("lost_client", _same, 0), 11: ("messages_published", _same, 0),
    12: ("refused", _same, 0)}


def _link(buf):
    link = _record(_LINK, buf)
    link.counters = dict(link.counters)
    return link


_STATUS = {
    1: ("version", _text, u""), 2: ("node_id", _same, 0), 3: ("epoch", _same, 0),
    4: ("uptime", _milliseconds, 0.0), 5: ("clients", _same, 0), 6: ("pose", _pose, None),
    7: ("links", _link, []), 8: ("channels", lambda buf: _record(_CHANNEL, buf), []),
    9: ("counters", _counter, []), 10: ("config_file", _text, u""),
    11: ("node_id_fixed", bool, False),
    12: ("programs", lambda buf: _record(_PROGRAM, buf), []),
    13: ("node_id_source", _text, u"")}


# ---- Publishers and subscribers -----------------------------------------------------------------

def _payload(data, what="a message"):
    if isinstance(data, bytes):
        return data
    if isinstance(data, _TEXT):
        return data.encode("utf-8")
    if isinstance(data, (bytearray, memoryview)):
        return data.tobytes() if isinstance(data, memoryview) else bytes(data)
    how = ".tobytes()" if hasattr(data, "tobytes") else "struct.pack() or json.dumps()"
    raise TypeError("%s is bytes or text, not %s; make bytes of it, with %s"
                    % (what, type(data).__name__, how))


def _number(value, what, least=0, most=0xFFFFFFFF):
    """An int of an argument, or BadArgument."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise _bad("%s must be a whole number, not %r" % (what, value))
    if not least <= value <= most:
        raise _bad("%s must be %d %s, not %d" % (
            what, least, "or more" if most == 0xFFFFFFFF and value < least else "to %d" % most,
            value))
    return int(value)


def _real(value, what):
    """A float of an argument, or BadArgument. Text is no number: "10" < "9"."""
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        hint = ""
        if isinstance(value, (bytes, _TEXT)):
            hint = "; make a number of the text with float()"
        raise _bad("%s, not %r%s" % (what, value, hint))
    return float(value)


def _flag(value, what):
    """True or False of an argument. Text is neither: "no" would be true."""
    if isinstance(value, (bytes, _TEXT)):
        raise _bad("%s must be True or False, not %r" % (what, value))
    return bool(value)


def _timeout(value, what):
    """Seconds of an argument that may be None; None: for ever."""
    if value is None:
        return None
    seconds = _real(value, what + " must be a number of seconds, or None")
    if not seconds >= 0:
        raise _bad("%s must be 0 seconds or more, or None, not %r" % (what, value))
    return None if seconds == float("inf") else seconds


def _repair_packets(value):
    """The redundancy of a publisher: a number, or "auto"."""
    if isinstance(value, (bytes, _TEXT)):
        if value in ("auto", b"auto"):
            return "auto"
        raise _bad("redundancy must be 0 to 12, or \"auto\", not %r" % (value,))
    return _number(value, "redundancy", 0, 12)


def _near(word, known, what):
    """ "; did you mean ...?" for a name that is misspelt; else `what` there is."""
    import difflib
    near = difflib.get_close_matches(word, known, 1)
    return "did you mean %r?" % near[0] if near else what


def _near_channel(name, known):
    """A channel that `name` may have been; those that differ in a number alone are meant to."""
    import difflib
    import re

    def unnumbered(word):
        return re.sub("[_./-]*[0-9]+", "", word)
    others = [each for each in known if unnumbered(each) != unnumbered(name)]
    near = difflib.get_close_matches(name, others, 1, 0.75)
    return near[0] if near else None


def _taking_one(function, what, argument):
    """A function of a program's that will be called with one argument, or BadArgument now, where
    the mistake is, not at the first message."""
    if not callable(function):
        raise _bad("%s must be a function of one %s, not %r" % (what, argument, function))
    import inspect
    try:
        if hasattr(inspect, "signature"):
            try:
                inspect.signature(function).bind(None)
            except ValueError:  # of a built-in function nothing is known
                if _is_of_a_handler():
                    raise
                return function
        else:  # Python 2, which can tell of its own functions only
            plain = getattr(function, "__func__", function)
            takes, args, _, defaults = inspect.getargspec(plain)
            takes = len(takes) - (getattr(function, "__self__", None) is not None)
            if not (takes - len(defaults or ()) <= 1 and (takes >= 1 or args)):
                raise TypeError("it takes %d" % takes)
    except TypeError as error:
        if hasattr(inspect, "signature") or inspect.isfunction(
                getattr(function, "__func__", function)):
            raise _bad("%s is called with one argument, the %s, and %s() cannot be: %s" % (
                what, argument, getattr(function, "__name__", "it"), error))
    return function


def _seconds(value, what):
    """Milliseconds of an argument in seconds, or BadArgument."""
    value = _real(value, what + " must be a number of seconds")
    if not 0 <= value <= 4e6:
        raise _bad("%s must be 0 to 4000000 seconds, not %r" % (what, value))
    return int(value * 1000 + 0.5)


class _Chosen(object):
    """What was chosen when a handle was made: setting it later would change nothing."""

    def __init__(self, name, call):
        self._name, self._call = name, call

    def __get__(self, handle, kind=None):
        return self if handle is None else getattr(handle, "_" + self._name)

    def __set__(self, handle, value):
        raise AttributeError("%s is chosen in %s(..., %s=...), and stays" % (
            self._name, self._call, self._name))


def _no_copy(self, protocol):
    """Instead of pickle's own words, for a multiprocessing.Process that is given one: since Python
    3.14 its arguments are copied."""
    raise TypeError("a Client, its publishers and its subscribers cannot be copied to another "
                    "process: make a Client in the function that runs there")


class _Handle(object):
    """What publishers and subscribers have in common: a registration with the daemon."""

    __slots__ = ("_channel", "label", "_client", "_timestamped", "_id", "_answered", "_closed",
                 "_failure", "channel_number")
    __reduce_ex__ = _no_copy

    def __init__(self, client, channel, timestamped):
        if isinstance(channel, (bytes, _TEXT)):
            try:
                name = channel if isinstance(channel, _TEXT) else channel.decode("utf-8")
                self._channel = _bytes(1, name.encode("utf-8"))
            except UnicodeError:
                raise BadArgument("bad_channel", "the name of a channel is not UTF-8 text")
            self.label = "channel " + _native(name)  # for sentences
        else:
            if isinstance(channel, bool) or not hasattr(channel, "__index__"):
                raise BadArgument("bad_channel", "a channel is a name or a number, not %r"
                                  % (channel,))
            if not 0 <= channel <= 65535:
                raise BadArgument("bad_channel", "channel numbers go from 0 to 65535, not %d"
                                  % channel)
            self._channel = _uint(2, int(channel))
            self.label = "channel %d" % channel  # for sentences
        self._client = client
        self._timestamped = None if timestamped is None else _flag(timestamped, "timestamped")
        self._id = 0
        self._answered = False
        self._closed = False
        self._failure = Error("disconnected", _NOT_CONNECTED)
        self.channel_number = None  # as the daemon has looked it up

    @property
    def status(self):
        """None while registered; else the Error that says why not."""
        return self._failure

    def close(self):
        """Unregisters. Nothing is sent or heard with it any more. In a child of fork() it does
        nothing."""
        client = self._client
        if os.getpid() == client._pid and (not self._closed or self in client._handles):
            client._close_handle(self)

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()


class Publisher(_Handle):
    """One end of a channel. Made by Client.advertise()."""

    __slots__ = ("_redundancy", "_ttl", "_queue", "_drop_oldest", "_repeat", "_interval_ms",
                 "_sent", "_sent_every", "_publish_number", "_in_flight", "_futures", "_max_ttl",
                 "_tells_time", "_head", "_told_busy_at", "_untold_busy", "_unreported_refused",
                 "_refused_reported_at", "_kept", "max_message_bytes", "has_redundancy")
    ttl, queue, drop_oldest, repeat, redundancy = [
        _Chosen(name, "advertise") for name in ("ttl", "queue", "drop_oldest", "repeat",
                                                "redundancy")]

    def __init__(self, client, channel, ttl, timestamped, queue, drop_oldest, repeat,
                 repeat_interval, sent, redundancy=0):
        _Handle.__init__(self, client, channel, timestamped)
        self._redundancy = _repair_packets(redundancy)
        self._ttl = None if ttl is None else _number(ttl, "ttl")
        self._queue = _number(queue, "queue")
        self._drop_oldest = _flag(drop_oldest, "drop_oldest") and self._queue > 0
        self._repeat = _number(repeat, "repeat", 1)
        self._interval_ms = (None if repeat_interval is None
                             else _seconds(repeat_interval, "repeat_interval"))
        if sent not in (None, True):
            _taking_one(sent, "sent", "error")
        self._sent = sent
        # Without a look at each, the daemon tells of several that have left at once.
        self._sent_every = 1
        if sent is None and not self._drop_oldest:
            self._sent_every = min(max((self._queue + 1) // 4, 1), _SENT_EVERY_MAX)
        self._publish_number = 0
        self._in_flight = deque()
        self._futures = {}
        self._max_ttl = 0
        self._tells_time = True
        self._head = b""
        self._told_busy_at = None
        self._untold_busy = 0
        self._unreported_refused = 0       # messages that the daemon does not know of
        self._refused_reported_at = -1e9   # by send() itself
        self._kept = {}                    # _Unseen by its id()
        self.max_message_bytes = 0  # the longest that send() takes
        self.has_redundancy = False  # messages get the repair packets that were asked for

    def send(self, data, ttl=None):
        """Hands one message to the daemon and returns at once. Any thread, also in the handler of
        a signal.

        Returns True; or, when it could not be taken, a Refused, which is false in an `if` and has
        `code` ("busy", "disconnected") and `text`. Raises BadArgument when the message is too long
        or the TTL too large, TypeError for what is neither bytes nor text.
        """
        return self._client._publish(self, _payload(data), ttl, None)

    def busy(self):
        """Whether send() would be refused because too many messages wait. Any thread, also in the
        handler of a signal."""
        self._client._need_own_process()
        if self._id != 0 and self._no_room() is not None:
            self._client._look_for_answers()
        return self._id != 0 and self._no_room() is not None

    def async_send(self, data, ttl=None):
        """In asyncio: send(), as something to await until the message has left.

        Raises Error, there or here, when it was refused or never will leave. The publisher must
        have been made with sent=True.
        """
        if self._sent is None and self._sent_every > 1:
            raise _bad("async_send() waits for each message: advertise(..., sent=True)")
        future = self._client.attach().create_future()
        result = self._client._publish(self, _payload(data), ttl, future)
        if not result:
            raise _error(result.code, result.text)
        return future

    def _end_futures(self):
        """It is closed: the daemon will not say any more what became of its messages."""
        loop = self._client._loop
        while self._futures:
            future = self._futures.popitem()[1]
            if not future.done() and not loop.is_closed():
                future.set_exception(Error("disconnected", "the publisher was closed before it was "
                                           "known whether this message left"))
                future.exception()  # nobody has to wait for it

    def _no_room(self):
        """Why another message cannot be taken, or None."""
        if len(self._client._outgoing) > _OUTGOING_MAX:
            return "swarmtalkd does not read what this program sends"
        if callable(self._sent) and len(self._client._events) >= _EVENTS_MAX:
            return "%d callbacks wait: call run() or process()" % len(self._client._events)
        if not self._drop_oldest and len(self._in_flight) > self._queue:
            waiting = len(self._in_flight)
            return "%d message%s not left yet" % (waiting, " has" if waiting == 1 else "s have")
        return None

    def _tell_busy(self, text):
        """A refusal that nobody looked at."""
        now = _monotonic()
        self._untold_busy += 1
        if self._told_busy_at is not None and now - self._told_busy_at < 1:
            return
        self._told_busy_at = now
        count, self._untold_busy = self._untold_busy, 0
        _print_error(
            "%s: %s not sent, and nobody looked at what send() returned: %s; send more slowly, "
            "try again when busy() is false, or advertise with a longer queue or drop_oldest=True"
            % (self.label, "a message was" if count == 1 else "%d messages were" % count, text))

    def _request(self):
        body = _bytes(1, self._channel)
        if self._ttl is not None:
            body += _uint(2, self._ttl)
        if self._timestamped is not None:
            body += _uint(3, bool(self._timestamped))
        if self._queue:
            body += _uint(4, self._queue)
        if self._drop_oldest:
            body += _uint(5, 1)
        if self._repeat != 1:
            body += _uint(6, self._repeat)
        if self._interval_ms is not None:
            body += _uint(7, self._interval_ms)
        if self._sent_every > 1:
            body += _uint(8, self._sent_every)
        if self._redundancy == "auto":
            body += _uint(10, 1)
        elif self._redundancy:
            body += _uint(9, self._redundancy)
        return _bytes(8, body)

    def _registered(self, reply):
        told = dict(_fields(reply[9], 0, len(reply[9])))
        self._max_ttl = told.get(4, 0)
        self.max_message_bytes = told.get(3, 0)
        self.channel_number = told.get(2, 0)
        self._tells_time = bool(told.get(5, 1))
        self.has_redundancy = bool(told.get(6, 0))
        self._head = _uint(1, told.get(1, 0))
        self._id = told.get(1, 0)

    def _unregister(self):
        return _bytes(10, _uint(1, self._id))


class Subscriber(_Handle):
    """The other end. Made by Client.subscribe().

    Without a callback, its messages are fetched: `for message in subscriber` waits for each (until
    stop()), get() waits for one, take() fetches all there are; in asyncio, `async for`.
    """

    __slots__ = ("_has_heard", "_receive", "_within", "_known_distance_only", "_keep_last",
                 "_latest_from_each", "_max_age_ms", "_waiting", "_lost", "_unreported_loss",
                 "_futures", "_is_fetched")
    within, known_distance_only, keep_last, latest_from_each, receive = [
        _Chosen(name, "subscribe") for name in ("within", "known_distance_only", "keep_last",
                                                "latest_from_each", "receive")]

    def __init__(self, client, channel, receive, within, known_distance_only, keep_last,
                 latest_from_each, no_older_than, timestamped):
        _Handle.__init__(self, client, channel, timestamped)
        if receive is not None:
            _taking_one(receive, "receive", "message")
        self._has_heard = False  # any message
        self._receive = receive
        self._within = None
        if within is not None:
            self._within = _real(within, "within must be a distance in metres")
            if not self._within >= 0:
                raise _bad("within must be 0 metres or more, not %r" % (within,))
        self._known_distance_only = _flag(known_distance_only, "known_distance_only")
        self._keep_last = None if keep_last is None else _number(keep_last, "keep_last", 1)
        self._latest_from_each = _flag(latest_from_each, "latest_from_each")
        self._max_age_ms = (None if no_older_than is None
                            else _seconds(no_older_than, "no_older_than"))
        self._waiting = deque()
        self._lost = None  # a Loss that the next message tells
        self._unreported_loss = 0
        self._futures = deque()
        self._is_fetched = receive is not None  # the program has looked for its messages

    # Messages fetched by the program.

    def get(self, timeout=None):
        """The next message; None after `timeout` seconds without one, or when stop() was called."""
        self._need_no_callback("get()")
        if not self._waiting:
            self._client._need_open()
        return self._get(_timeout(timeout, "timeout"))

    def _get(self, timeout=None):
        return self._pop() if self._client._wait_for_message(self, timeout) else None

    def take(self):
        """All messages that have come, oldest first, without waiting."""
        self._need_no_callback("take()")
        self._client._look_for_messages(self)
        messages, none = [], deque()
        messages += self._waiting
        self._waiting = none
        return messages

    def __iter__(self):
        self._need_no_callback("iteration")
        return self

    def __next__(self):
        message = self._get()
        if message is None:
            raise StopIteration
        return message

    next = __next__

    def __aiter__(self):
        self._need_no_callback("iteration")
        self._client.attach()
        return self

    def __anext__(self):
        return _Coming(self)

    def _need_no_callback(self, what):
        if self._receive is not None:
            raise _bad("%s is for a subscriber without a callback; this one of %s has one"
                       % (what, self.label))
        self._is_fetched = True

    # What waits, and what goes first.

    def _put(self, message, incoming, size):
        """Queues a message, and takes away the bytes that it came in. Returns whether there is an
        event for it."""
        before = len(self._waiting)
        if self._latest_from_each:
            for index, other in enumerate(self._waiting):
                if other.sender == message.sender and other.epoch == message.epoch:
                    self._drop(index)
                    break
        most = self._keep_last
        if most is None and self._receive is None:
            most = MESSAGES_THAT_WAIT
        if most is not None and len(self._waiting) >= most:
            self._drop(0)
        is_event = len(self._waiting) == before and self._receive is not None
        if is_event and len(self._client._events) >= _EVENTS_MAX:
            self._client._drop_oldest_message()
        lost, total = self._lost, len(incoming)
        if lost is not None:
            message.lost_before.add(lost)
        event, events, waiting = ("message", self), self._client._events, self._waiting
        try:
            self._lost = None
            waiting += (message,)
            if is_event:
                events += (event,)
            del incoming[:size]
        except BaseException:  # a handler's, before Python 3.10
            if len(incoming) == total:  # it will be read once more
                self._lost = lost
                _take_back(waiting, message)
                _take_back(events, event)
            raise
        return is_event

    def _drop(self, index):
        """Drops a message that waits; the next one tells."""
        waiting, teller = self._waiting, Loss(client=1)
        is_last = index + 1 == len(waiting)
        teller.add(waiting[index].lost_before)
        if not is_last:
            teller.add(waiting[index + 1].lost_before)
        elif self._lost is not None:
            teller.add(self._lost)
        _in_one(partial(setattr, self, "_lost", teller) if is_last
                else partial(setattr, waiting[index + 1], "lost_before", teller),
                partial(waiting.__delitem__, index),
                partial(setattr, self, "_unreported_loss", self._unreported_loss + 1),
                partial(setattr, self._client, "_has_unreported_loss", True))

    def _is_ready(self, index=0):
        """Whether a message waits at this place. It is not too old then, and on_gap has been told
        of what was lost before it."""
        while len(self._waiting) > index:
            message = self._waiting[index]
            if self._max_age_ms is not None and message.age * 1000 > self._max_age_ms:
                self._drop(index)
            elif message.lost_before and self._client.on_gap and not message._is_gap_told:
                message._is_gap_told = True
                self._client._hand_on(partial(self._client.on_gap, message))
            else:
                return True
        return False

    def _pop(self):
        """The first message that waits, or None."""
        if not self._waiting:
            return None
        message = self._waiting[0]
        del self._waiting[0]
        return message

    def _serve_futures(self):
        """Wakes all who wait in asyncio; each takes a message, if one is left then."""
        if self._futures and self._client._loop.is_closed():
            self._futures.clear()
        while self._futures and (self._waiting or self._closed):
            future = self._futures[0]
            if not future.done():
                future.set_result(None)
            del self._futures[0]

    def _request(self):
        body = _bytes(1, self._channel)
        if self._keep_last is not None:
            body += _uint(2, self._keep_last)
        if self._within is not None:
            body += _float(3, self._within)
        if self._known_distance_only:
            body += _uint(4, 1)
        if self._timestamped is not None:
            body += _uint(5, bool(self._timestamped))
        if self._latest_from_each:
            body += _uint(6, 1)
        if self._max_age_ms is not None:
            body += _uint(7, self._max_age_ms)
        return _bytes(5, body)

    def _registered(self, reply):
        told = dict(_fields(reply[6], 0, len(reply[6])))
        self.channel_number = told.get(2, 0)
        self._id = told.get(1, 0)

    def _unregister(self):
        return _bytes(7, _uint(1, self._id))


class _Coming(object):
    """To await the next message of a subscriber. It stays there until the task that waits runs
    again: a task that is cancelled meanwhile, as wait_for() does, would lose it."""

    def __init__(self, subscriber):
        self._subscriber = subscriber

    def __await__(self):
        return self

    __iter__ = __await__

    def __next__(self):
        subscriber = self._subscriber
        loop = subscriber._client.attach()
        if subscriber._is_ready():
            message = StopIteration(subscriber._waiting[0])
            del subscriber._waiting[0]
            raise message
        if subscriber._closed or subscriber._client._closed:
            raise StopAsyncIteration  # noqa: F821 (Python 2 has none)
        future, futures = loop.create_future(), subscriber._futures
        futures += (future,)
        return next(future.__await__())


# ---- The connection -----------------------------------------------------------------------------

_DOWN, _GREETING, _REGISTERING, _UP = range(4)


def _check_options(method, options):
    """Told here rather than by Python, which knows no near names before 3.12."""
    known = method.__code__.co_varnames[1:method.__code__.co_argcount]
    for name in options:
        if name not in known:
            raise TypeError("%s() has no option %r; %s" % (
                method.__name__, name, _near(name, known, "it has " + ", ".join(known))))


class _Inside(object):
    """Who is inside a Client, and doing what. Set without a call, so that what a handler raises
    leaves nothing half done."""

    __slots__ = ("thread", "looker", "calling", "processing", "connecting", "ending", "closes")

    def __init__(self):
        self.thread = None       # in a call that only the owner may make
        self.looker = None       # a thread whose send() looks for answers
        self.calling = False     # the owner is in a function of the program's
        self.processing = False
        self.connecting = False  # somebody waits for it
        self.ending = False      # last words are read
        self.closes = False      # when the call is over, as a handler has asked

    def is_cut_by(self, thread):
        """Whether a handler calls, in the middle of a call of this thread."""
        return thread == self.looker or thread == self.thread and not self.calling


def _owned(method):
    """For what only the thread that owns the Client may call."""
    def guarded(self, *arguments, **options):
        if options:
            _check_options(method, options)
        self._need_own_process()
        inside, me = self._inside, _thread_id()
        self._forget_what_was_cut(me)
        if inside.is_cut_by(me):
            raise _bad("a signal came while this program was inside another call of this Client: "
                       "its handler may call send(), busy(), stop() and close() only; set a "
                       "variable there, and look at it where the program runs")
        if inside.thread == me:  # in a callback
            try:
                inside.calling = False
                return method(self, *arguments, **options)
            finally:
                inside.calling = True
        taken = []
        try:
            taken.extend(_filter(None, _map(self._owner.acquire, (False,))))
            if not taken:
                raise _bad("another thread is inside this Client (in %s()); only send(), busy() "
                           "and stop() may be called meanwhile"
                           % ("run" if self._running else "process"))
            inside.thread = me
            with self._reading:  # a thread that sends may look for answers, which is short
                return method(self, *arguments, **options)
        finally:
            if taken:
                self._leave()
                if inside.closes:
                    self.close()
    guarded.__name__, guarded.__doc__ = method.__name__, method.__doc__
    guarded.__qualname__ = "Client." + method.__name__
    _entrances.add(guarded.__code__)
    return guarded


_entrances = set()  # the code of the calls that are noted in _Inside


def _who_may_connect(path):
    """What helps a user who may not write to this socket."""
    if os.access(path, os.W_OK):
        return ("this user may use it, so something else confines the program (a container, a "
                "snap, AppArmor, SELinux, or the sandbox of a unit): allow it this socket there")
    group = "swarmtalk"
    try:
        import grp
        import pwd
        its = os.stat(path)
        try:
            group = grp.getgrgid(its.st_gid).gr_name
        except KeyError:
            group = None
        if its.st_gid == 0 or not its.st_mode & stat.S_IWGRP or group is None:
            try:
                user = pwd.getpwuid(its.st_uid).pw_name
            except KeyError:
                user = "uid %d" % its.st_uid
            return ("it is for %s alone: run the program as %s%s, or name a group for it, group "
                    "under [socket] of the daemon's configuration"
                    % (user, user, "" if its.st_uid else " (sudo)"))
    except (ImportError, OSError):
        if path != DEFAULT_SOCKET:
            return ("its folder is closed to this user: run the program as the user who started "
                    "swarmtalkd (sudo, if that is root)")
    return "join group %s: sudo usermod -aG %s $USER, then log in again" % (group, group)


def _lab_in(base):
    """The name of a lab of which swarmtalk-lab keeps a folder there: that in SWARMTALK_LAB, else
    the usual one, else any; None: there is none."""
    named = os.environ.get("SWARMTALK_LAB")
    names = [named or "lab"]
    if not named:
        try:
            names += sorted(os.listdir(base))
        except OSError:  # there is none
            if _is_of_a_handler():
                raise
    for name in names:
        if os.access("%s/%s/lab.json" % (base, name), os.F_OK):
            return name
    return None


def _how_to_start():
    """What helps where the socket of the installed daemon is missing. A program that was meant for
    a robot of a lab ran beside it."""
    own = _lab_in("/tmp/swarmtalk-lab-%d" % os.geteuid())
    if own is None and "XDG_RUNTIME_DIR" in os.environ:
        own = _lab_in(os.environ["XDG_RUNTIME_DIR"] + "/swarmtalk-lab")
    name = own or _lab_in("/run/swarmtalk-lab")
    if name is None:
        return "start it with: systemctl start swarmtalkd"
    return ("a lab is up, and as its robot 1 a program runs with: %sswarmtalk-lab %sexec 1 -- "
            "PROGRAM" % ("" if own or os.geteuid() == 0 else "sudo ",
                         "" if name == "lab" or os.environ.get("SWARMTALK_LAB")
                         else "--name %s " % name))


def _connect_error(number, path):
    """The sentence for a connect() that failed."""
    standard = path == DEFAULT_SOCKET
    if number == errno.ECONNREFUSED:
        try:
            if not stat.S_ISSOCK(os.stat(path).st_mode):
                number = errno.ENOTSOCK
        except OSError as error:  # it was taken away meanwhile
            if _is_of_a_handler():
                raise
            number = error.errno
    if number in (errno.ENOENT, errno.ENOTDIR):
        return Error("no_daemon", "cannot reach swarmtalkd: %s does not exist; %s" % (
            path, _how_to_start() if standard else "start swarmtalkd for that socket"))
    if number == errno.ECONNREFUSED:
        return Error("daemon_dead", "cannot reach swarmtalkd: %s is there but nobody listens, so "
                     "the daemon has died; %s" % (
                         path, "start it with: systemctl restart swarmtalkd" if standard
                         else "start swarmtalkd for that socket"))
    if number in (errno.ENOTSOCK, errno.EPROTOTYPE):
        return Error("no_daemon",
                     "cannot reach swarmtalkd: %s is not a socket of swarmtalkd" % path)
    if number in (errno.EACCES, errno.EPERM):
        return Error("no_permission", "no permission for %s; %s" % (path, _who_may_connect(path)))
    if number == errno.EAGAIN:
        return Error("timeout", "swarmtalkd at %s accepts no connections; it is stopped or "
                     "overloaded" % path)
    return Error("system", "cannot connect to %s: %s" % (path, _why(number)))


_thread_id = getattr(threading, "get_ident", None) or getattr(threading, "_get_ident")


def _interruptible(poll, timeout):
    """A poll of Python 2 ends with an error when a signal comes; one of Python 3 goes on."""
    try:
        return poll(timeout)
    except (OSError, IOError, select.error) as error:
        if error.args[:1] != (errno.EINTR,) or _is_of_a_handler():
            raise
        return []


class _Session(object):
    """What is behind a Client: the life of its connection, what comes in and what goes out. The
    owner's thread only, but for _publish() and what it calls. Client.__init__ makes its variables.
    """

    __reduce_ex__ = _no_copy

    # -- The connection's life: attempts with growing pauses, greeting, loss.

    def _need_own_process(self):
        if os.getpid() != self._pid:
            raise _bad("this Client belongs to the parent process; make one after the fork")

    def _leave(self):
        """The call of the thread that owns the Client is over."""
        inside = self._inside
        _in_one(partial(setattr, inside, "processing", False),
                partial(setattr, inside, "calling", False),
                partial(setattr, inside, "thread", None), partial(self._owner.release))

    def _stop_looking(self):
        _in_one(partial(setattr, self._inside, "looker", None), partial(self._reading.release))

    def _forget_what_was_cut(self, me):
        """Before Python 3.10 a handler may raise where a call of this thread ends, and nothing of
        that end is done: no frame of it is left then, beyond the one that asks."""
        inside = self._inside
        if me != inside.thread and me != inside.looker:
            return
        frame = sys._getframe(2)
        while frame is not None:
            if frame.f_code in _entrances and frame.f_locals.get("self") is self:
                return
            frame = frame.f_back
        if me == inside.thread:
            self._leave()
        if me == inside.looker:
            self._stop_looking()

    def _hand_on(self, *steps):
        """The last of them calls a function of the program's."""
        inside = self._inside
        into = partial(setattr, inside, "calling", True)
        out_of = partial(setattr, inside, "calling", False)
        try:
            _in_one(into, *steps + (out_of,))
            if inside.calling:  # deque() takes it for the end of its steps
                raise StopIteration
        finally:
            inside.calling = False
        self._need_own_process()  # the function may have forked

    def _need_open(self):
        if not self._closed:
            return
        if _ending and not isinstance(threading.current_thread(), threading._MainThread):
            raise SystemExit  # a thread of a program that has ended; nobody prints this
        raise Error("disconnected", "this Client is closed")

    def _attempt(self):
        """One try to open the socket. Success means: greeting sent, answer awaited."""
        self._started = True
        self._set_timer(None)
        self._failure = None
        connection = None
        try:
            connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
            connection.setblocking(False)
            _libc.fcntl(connection.fileno(), 2, 1)  # F_SETFD, FD_CLOEXEC
            connection.connect(self._path)
            self._epoll.register(connection.fileno(), select.EPOLLIN)
        except (OSError, IOError) as error:  # IOError: Python 2
            if connection is not None:
                connection.close()
            if _is_of_a_handler():
                raise
            if error.errno is None:  # Python's own check
                self._failure = _bad("socket path too long: " + self._path)
            else:
                self._failure = _connect_error(error.errno, self._path)
            self._schedule_attempt()
            return
        with self._gate:
            self._socket = connection
            self._outgoing, self._incoming = bytearray(), bytearray()
            self._write_error = None
            self._wants_write = False
        self._phase = _GREETING
        self._set_timer(self.connect_timeout)
        self._append(_bytes(2, _uint(1, _MAJOR) + _uint(2, _MINOR) + _bytes(4, self._name)))
        self._flush()

    def _attempt_in_background(self):
        self._attempt()
        if self._failure is not None and self._phase == _DOWN:
            self._report_attempt(self._failure)

    def _schedule_attempt(self):
        # Half to all of the pause: many clients of one daemon must not return in step.
        self._set_timer(self._backoff * random.uniform(0.5, 1))
        self._backoff = min(_RECONNECT_MAX_S, self._backoff * 2)

    def _set_timer(self, seconds):
        self._timer_at = None if seconds is None else _monotonic() + seconds
        _set_timer(self._timer, seconds)

    def _take_timer(self):
        if self._timer_at is None or _monotonic() < self._timer_at:
            return
        self._set_timer(None)
        if self._phase == _DOWN:
            self._attempt_in_background()
        elif self._phase != _UP:
            self._drop(self._no_answer())
        else:
            self._look_around()

    def _no_answer(self):
        return Error("timeout", "swarmtalkd at %s did not answer within %g s; it is stopped or "
                     "overloaded" % (self._path, self.connect_timeout))

    def _release_socket(self):
        if self._socket is None:
            return
        try:
            self._epoll.unregister(self._socket.fileno())
        except (OSError, IOError, ValueError):  # it was cut here before, by a signal's handler
            if _is_of_a_handler():
                raise
        with self._gate:
            self._socket.close()
            self._socket = None
            self._outgoing = bytearray()

    def _drop(self, why):
        """Ends this connection; the next attempt is scheduled, all that waited is answered."""
        if self._phase != _DOWN:
            self._set_timer(None)  # first: _mend() knows by it what was not done to the end
            self._phase = _DOWN
            self._end(why)

    def _mend(self):
        """What a handler raised may have cut an attempt or a loss in the middle."""
        if self._started and self._phase != _UP and self._timer_at is None:
            self._phase = _DOWN
            self._end(self._failure or Error(
                "disconnected", "lost swarmtalkd: a signal came in between; reconnecting"))

    def _end(self, why):
        self._release_socket()
        self._failure = why
        if self._was_up:
            self._was_up, self._is_reconnect = False, True
            self._post(("disconnect", why))
        else:
            self._report_attempt(why)
        self._forget_registrations()
        if why.code == "version_mismatch":
            self._backoff = _RECONNECT_MAX_S
        self._schedule_attempt()

    def _forget_registrations(self):
        gone = Error("disconnected", _NOT_CONNECTED)
        for handle in self._handles:
            numbers, futures = (), {}
            with self._gate:
                handle._id, handle._failure = 0, gone
                if isinstance(handle, Publisher):
                    numbers, handle._in_flight = handle._in_flight, deque()
                    futures, handle._futures = handle._futures, {}
            for number in numbers:
                self._post(("sent", handle, gone, futures.get(number)))
        self._publishers.clear()
        self._subscribers.clear()
        pending, self._pending = self._pending, {}
        for done in pending.values():
            done(None, gone)
        self._next_pose = None

    def _become_up(self):
        self._phase = _UP
        self._was_up = True
        self._set_timer(None)
        self._quiet_until = None
        self._backoff = _RECONNECT_FIRST_S
        self._failure = self._reported_failure = None
        if self._is_reconnect:
            self._is_reconnect = False
            self._post(("reconnect",))

    # -- Bytes in and out.

    def _ring(self):
        """Makes the descriptor readable. Any thread."""
        self._rung = True
        try:
            os.write(self._wake_write, b"!")
        except (OSError, TypeError):  # full, which is as good; closed
            if _is_of_a_handler():
                raise
        self._rung = True  # again: what was drained in between was written after it

    def _drain_pipe(self):
        try:
            while len(os.read(self._wake_read, 4096)) == 4096:
                pass
        except OSError:
            if _is_of_a_handler():
                raise

    def _append(self, envelope):
        frame = _frame(envelope)
        with self._gate:
            outgoing = self._outgoing
            outgoing += frame

    def _write(self):
        """As much as the socket takes. Any thread, inside the gate."""
        outgoing = self._outgoing
        while self._socket is not None and outgoing:
            try:  # sent and taken away in one call
                next(_map(outgoing.__delitem__, _map(slice, _map(self._socket.send, (outgoing,)))))
            except (OSError, IOError) as error:
                if _is_of_a_handler():
                    raise
                if error.errno == errno.EINTR:
                    continue
                if error.errno not in (errno.EAGAIN, errno.EWOULDBLOCK):
                    self._write_error = os.strerror(error.errno)
                return

    def _flush(self):
        if self._phase == _DOWN or self._inside.ending:
            return
        with self._gate:
            self._write()
            wants_write = bool(self._outgoing) and self._write_error is None
            failed = self._write_error
        if failed is not None:
            self._read_last_words(Error("disconnected",
                                        "lost swarmtalkd: %s; reconnecting" % failed))
        elif wants_write != self._wants_write:
            self._epoll.modify(self._socket.fileno(),
                               select.EPOLLIN | (select.EPOLLOUT if wants_write else 0))
            self._wants_write = wants_write

    def _write_request(self):
        """What this meets inside process() is dealt with at its end."""
        if not self._inside.processing:
            return self._flush()
        with self._gate:
            self._write()

    def _read_last_words(self, why):
        """Nothing can be written any more, but why may wait to be read. Ends in _drop()."""
        inside = self._inside
        try:
            inside.ending = True
            while self._read():
                pass
        finally:
            inside.ending = False
        self._drop(why)

    def _read(self):
        """Reads once and handles what has come. Returns whether there may be more."""
        if self._phase == _DOWN:
            return False
        incoming = self._incoming
        total = len(incoming)
        try:  # read and kept in one call
            next(_map(incoming.extend, _map(self._socket.recv, (_READ_BYTES,))))
        except (OSError, IOError) as error:
            if _is_of_a_handler():
                raise
            if error.errno in (errno.EAGAIN, errno.EWOULDBLOCK, errno.EINTR):
                self._take_frames(incoming)  # that were left when a handler raised
            elif self._take_frames(incoming):
                self._drop(Error("disconnected", "lost swarmtalkd: %s; reconnecting"
                                 % os.strerror(error.errno)))
            return False
        count = len(incoming) - total
        if not count:
            if self._take_frames(incoming):
                self._drop(Error("disconnected",
                                 "lost swarmtalkd: it closed the connection; reconnecting"))
            return False
        return self._take_frames(incoming) and (count == _READ_BYTES or self._inside.ending)

    def _take_frames(self, incoming):
        """Handles the frames that are whole. Returns whether the connection goes on."""
        try:
            while len(incoming) >= 4:
                size = 4 + _unpack_length(incoming, 0)[0]
                if not 4 < size <= 4 + _FRAME_MAX:
                    raise ValueError("an impossible length")
                if size > len(incoming):
                    break
                self._handle(dict(_fields(incoming, 4, size)), incoming, size)
                if self._phase == _DOWN:
                    return False
        except (ValueError, IndexError, struct.error, KeyError, TypeError):
            if _is_of_a_handler():
                raise
            self._drop(Error("protocol", "swarmtalkd sent something that is not the protocol"))
            return False
        return True

    # -- What comes in.

    def _handle(self, envelope, incoming, size):
        """Does what one frame says, and then takes its bytes away; of what a handler cuts here,
        the next look does the rest."""
        if self._phase == _GREETING:
            self._handle_greeting(envelope)
        elif 13 in envelope:
            return self._handle_message(envelope[13], incoming, size)
        elif 12 in envelope:
            told = dict(_fields(envelope[12], 0, len(envelope[12])))
            return self._handle_publish_end(told.get(1, 0), told.get(2, 0), None, incoming, size)
        elif 1 in envelope:
            done = self._pending.get(envelope[1])
            if done is not None:  # else its caller gave up waiting
                if 3 in envelope:
                    done(None, self._convert_failure(envelope[3])[0])
                else:
                    done(envelope, None)
                self._pending.pop(envelope[1], None)
        elif 3 in envelope:
            error, publisher, number = self._convert_failure(envelope[3])
            if publisher is not None:
                return self._handle_publish_end(publisher, number, error, incoming, size)
            self._told_alone = True  # it says why nothing is heard: no link is up, say
            self._post(("error", error))
        # Anything else is from a newer minor: not for us.
        del incoming[:size]

    def _handle_message(self, deliver, incoming, size):
        fields = _fields(deliver, 0, len(deliver))
        subscriber = None
        for number, value in fields:
            if number == 1:
                subscriber = self._subscribers.get(value)
        if subscriber is None:  # it was on its way when we unsubscribed
            del incoming[:size]
            return
        message = Message(fields)
        self._has_heard = subscriber._has_heard = True
        if subscriber._put(message, incoming, size) and not self._inside.processing:
            self._ring()

    @staticmethod
    def _convert_failure(body):
        told = dict(_fields(body, 0, len(body)))
        code = _CODES.get(told.get(1, 0), "protocol")
        text = _native(_text(told.get(2, b""))) or "swarmtalkd refused: " + code
        return _error(code, text), told.get(4), told.get(5, 0)

    def _handle_greeting(self, envelope):
        if 3 in envelope:
            return self._drop(self._convert_failure(envelope[3])[0])
        told = dict(_fields(envelope[2], 0, len(envelope[2])))
        name = _native(_text(told.get(4, b"")))
        if told.get(1, 0) != _MAJOR:
            return self._drop(Error(
                "version_mismatch", "%s at %s speaks local protocol %d.%d, this program %d.%d; "
                "update the older of the two" % (name, self._path, told.get(1, 0), told.get(2, 0),
                                                 _MAJOR, _MINOR)))
        self.node_id, self.daemon_name = told.get(5, 0), name
        self._phase = _REGISTERING
        self._registrations_left = 1  # ours, so that no answer ends the phase before all are asked
        for handle in self._handles:
            self._register(handle)
        self._end_registration()

    def _end_registration(self):
        if self._phase == _REGISTERING:
            self._registrations_left -= 1
            if self._registrations_left == 0:
                self._become_up()

    def _handle_publish_end(self, publisher_id, number, error, incoming, size):
        publisher = self._publishers.get(publisher_id)
        if publisher is None:
            if _is_failure(error):
                self._post(("untold", Error(error.code, "a message was not sent: " + error.text)))
            del incoming[:size]
            return
        with self._gate:
            in_flight = publisher._in_flight
            if error is None and publisher._sent_every > 1:  # it has no callback
                while in_flight and in_flight[0] <= number:
                    del in_flight[0]
                del incoming[:size]
                return
            future = publisher._futures.get(number)
            is_awaited = callable(publisher._sent) or future is not None
            is_event = number in in_flight and (is_awaited or _is_failure(error))
            is_left_out = is_event and not is_awaited and self._is_full_of_failures()
            event, events, total = ("sent", publisher, error, future), self._events, len(incoming)
            index = list(in_flight).index(number) if number in in_flight else None
            try:
                if is_left_out:
                    self._left_out = [self._left_out[0] + 1, error]
                elif is_event and not self._closed:
                    events += (event,)
                if index is not None:
                    del in_flight[index]
                del incoming[:size]
            except BaseException:  # a handler's, before Python 3.10
                if len(incoming) == total:  # it will be read once more
                    _take_back(events, event)
                    if index is not None and number not in in_flight:
                        in_flight.rotate(-index)
                        in_flight.appendleft(number)
                        in_flight.rotate(index)
                raise
            publisher._futures.pop(number, None)
        if is_event and not self._inside.processing:
            self._ring()

    def _post(self, event):
        if self._closed:
            return
        if event[0] in ("untold", "error") and self._is_full_of_failures():
            self._left_out[:] = self._left_out[0] + 1, event[1]
            return
        self._events.append(event)
        if not self._inside.processing:
            self._ring()

    def _is_full_of_failures(self):
        return len(self._events) >= 2 * _EVENTS_MAX  # of messages there are half as many

    def _tell_left_out(self):
        """Those that came to a program that never ran, which were too many to keep."""
        count, error = self._left_out
        if count:
            self._left_out = [0, None]
            self._events.append(("untold", Error("limit", "%d more failure%s while this program "
                                                 "did not run; the last one: %s" % (
                                                     count, "" if count == 1 else "s",
                                                     error.text))))

    def _drop_oldest_message(self):
        for index, event in enumerate(self._events):
            if event[0] == "message":
                if event[1]._waiting:
                    event[1]._drop(0)
                del self._events[index]
                return

    def _run_events(self):
        events = self._events
        self._tell_left_out()
        while events:
            event = events[0]
            if event[0] == "message":
                subscriber = event[1]
                is_due = not subscriber._closed and subscriber._is_ready()
                if not events or events[0] is not event:  # a function of the program's did more
                    continue
                if not is_due:
                    del events[0]
                    continue
                self._hand_message_on(event, subscriber._waiting, subscriber._receive)
                continue
            function, arguments = self._whom_to_tell(event)
            telling = [partial(function, *arguments)] if function else []
            self._hand_on(partial(events.popleft), *telling)
        for handle in self._handles:
            if isinstance(handle, Subscriber) and handle._futures:
                handle._serve_futures()

    def _hand_message_on(self, event, waiting, receive):
        """The first event's. It is taken, and the function called with it, in one call."""
        inside, events, message = self._inside, self._events, waiting[0]
        handing = _map(receive, iter(waiting.popleft, None))
        try:
            del events[0]
            inside.calling = True
            next(handing)
        except BaseException:
            if waiting and waiting[0] is message:  # not yet; a handler's, before Python 3.10
                events.appendleft(event)
            raise
        finally:
            inside.calling = False
        self._need_own_process()  # the function may have forked

    def _whom_to_tell(self, event):
        """The function of the program's for what has happened, or None, and what it gets."""
        kind = event[0]
        if kind == "sent":
            return self._whom_to_tell_of_sending(*event[1:])
        if kind == "disconnect":
            return self.on_disconnect, event[1:]
        if kind == "reconnect":
            return self.on_reconnect, ()
        return self.on_error, event[1:]

    def _whom_to_tell_of_sending(self, publisher, error, future):
        if future is not None and not future.done():
            if error is None:
                future.set_result(None)
            else:
                future.set_exception(error)
        if publisher._closed:
            return None, ()
        if callable(publisher._sent):
            return publisher._sent, (error,)
        return self.on_error if future is None and _is_failure(error) else None, (error,)

    def _report(self, error):
        self._post(("error", error))

    def _report_attempt(self, error):
        """Told once, not at each attempt, and not after "lost swarmtalkd" when all it says is that
        the daemon is still away."""
        if self._inside.connecting or self._reported_failure == error.code:
            return
        self._reported_failure = error.code
        if not (self._is_reconnect and error.code in ("no_daemon", "daemon_dead", "disconnected")):
            self._report(error)

    def _print_once_a_second(self, error):
        told = self._told.setdefault(error.code, [-1e9, 0, ""])  # when, untold since, the last text
        told[1:] = told[1] + 1, error.text
        if _monotonic() - told[0] >= 1:
            self._tell(told)

    @staticmethod
    def _tell(told, is_last=False):
        times = told[1]
        is_more = times > 1 or is_last
        _print_error(told[2] + (" (%d time%s since the last line)" % (times, "s" * (times > 1))
                                if is_more else ""))
        told[:2] = _monotonic(), 0

    def _report_losses(self):
        """The daemon counts what programs lose."""
        if not self._has_unreported_loss or self._phase != _UP:
            return
        self._has_unreported_loss = False
        for handle in self._handles:
            if isinstance(handle, Publisher):
                self._report_refused(handle)
            elif handle._unreported_loss and handle._id:
                lost = handle._unreported_loss
                frame = _frame(_bytes(19, _uint(1, handle._id) + _uint(2, lost)))
                with self._gate:
                    outgoing = self._outgoing
                    handle._unreported_loss = 0
                    outgoing += frame

    # -- What goes out.

    def _request(self, body, done, leaving=None):
        """leaving: a table, and the key of what leaves it with this."""
        number = self._last_request = self._last_request % 0xFFFFFFFF + 1
        frame = _frame(_uint(1, number) + body)
        with self._gate:
            outgoing, pending = self._outgoing, self._pending
            outgoing += frame
            pending[number] = done
            if leaving is not None:
                del leaving[0][leaving[1]]
        return number

    def _need_connection(self):
        self._need_open()
        if not self._started:
            self._connect()
        if self._phase != _UP:
            raise self._failure or Error("disconnected",
                                         _NOT_CONNECTED)

    def _ask(self, body):
        """Sends a request and waits for its reply: {field: value} of the envelope."""
        self._need_connection()
        answers = []
        number = self._request(body, lambda reply, error: answers.append((reply, error)))
        if not self._wait_until(_monotonic() + self.request_timeout, lambda: answers):
            self._pending.pop(number, None)
            raise Error("timeout", "swarmtalkd did not answer in time")
        reply, error = answers[0]
        if error is not None:
            raise error
        return reply

    def _wait_until(self, deadline, enough):
        """Waits without running callbacks. Returns enough()."""
        is_over = False
        try:
            while True:
                self._flush()
                while self._read():
                    pass
                self._flush()
                done = enough()
                left = deadline - _monotonic()
                if done or left <= 0:
                    is_over = not self._events
                    return done
                if self._timer_at is not None:
                    left = min(left, max(self._timer_at - _monotonic(), 0))
                poll = select.poll()
                if self._socket is not None:
                    poll.register(self._socket.fileno(), select.POLLIN | (
                        select.POLLOUT if self._outgoing else 0))
                _interruptible(poll.poll, int(left * 1000) + 1)
                self._take_timer()
        finally:
            if not is_over:
                self._ring()

    def _poll(self, seconds):
        _interruptible(self._epoll.poll, -1 if seconds is None else max(seconds, 0))

    def _run_once(self, timeout):
        """Returns whether stop() was called."""
        if not self._take_stop():
            if not self._inside.processing:
                self._poll(timeout)
            self._process()
            return self._take_stop()
        return True

    def _take_stop(self):
        stopped, self._stopped = self._stopped, False
        return stopped or self._closed

    def _add(self, handle):
        """Registers a new handle, now or, without a daemon, when it comes. Raises a refusal. The
        program gets no handle then, and nothing stays registered."""
        try:
            self._need_open()
            self._handles.append(handle)
            self._adding = handle
            self._register_first(handle)
            if handle._failure is not None and handle._failure.code != "disconnected":
                raise handle._failure
            self._tell_many(handle)
            self._tell_digits(handle)
            self._tell_wildcard(handle)
            if isinstance(handle, Subscriber):
                self._begin_to_listen(handle)
        except BaseException:
            handle._closed = True  # an answer on its way will end it
            self._end_handle(handle)
            raise
        finally:
            self._adding = None
        return handle

    def _register_first(self, handle):
        if not self._started:
            try:
                self._connect()  # registers it as well
            except Error as error:
                if _is_of_a_handler():
                    raise
                self._report(error)
        elif self._phase in (_UP, _REGISTERING):
            self._register(handle)
            if not self._wait_until(_monotonic() + self.request_timeout,
                                    lambda: handle._answered):
                raise Error("timeout", "swarmtalkd did not answer in time")

    def _begin_to_listen(self, subscriber):
        self._ring()  # an event loop comes by, and from then on it is watched whether it hears
        if subscriber._receive is not None and self._heard_nothing_of is None:
            self._subscribed_at = _monotonic()
            self._heard_nothing_of = subscriber.label

    def _register(self, handle):
        if self._phase == _REGISTERING:
            self._registrations_left += 1
        handle._answered = False
        known = [False]

        def done(reply, error):
            handle._answered = True
            if error is None:
                if not known[0]:  # a handler may have cut it after that
                    with self._gate:
                        handle._registered(reply)
                        handle._failure = None
                    table = self._table_of(handle)
                    table[handle._id], known[0] = handle, True
                if handle._closed:  # meanwhile
                    self._end_handle(handle)
            elif error.code != "disconnected" and not handle._closed:
                handle._failure = error
                if handle is not self._adding:  # nobody waits for it
                    self._report(error)
            self._end_registration()

        self._request(handle._request(), done)

    @_owned
    def _close_handle(self, handle):
        """Unregisters it. A call that waits for a message of it gets none."""
        handle._closed = True
        if isinstance(handle, Publisher):
            self._report_refused(handle)
        self._end_handle(handle)
        if isinstance(handle, Subscriber):
            handle._serve_futures()
        else:
            handle._end_futures()

    def _table_of(self, handle):
        return self._publishers if isinstance(handle, Publisher) else self._subscribers

    def _end_handle(self, handle):
        """It is among all handles to the end: of what a handler cuts here, another close() does
        the rest."""
        table, number = self._table_of(handle), handle._id
        if table.get(number) is handle:
            if self._socket is not None:
                self._request(handle._unregister(), self._note_refusal, (table, number))
            else:
                del table[number]
        handle._failure, handle._id = Error("disconnected", "this handle was closed"), 0
        self._write_request()
        if handle in self._handles:
            self._handles.remove(handle)

    @_owned
    def _look_for_messages(self, subscriber):
        """Makes all ready that has come to a subscriber without a callback."""
        if not self._inside.processing:
            self._process()
        count = 0
        while subscriber._is_ready(count):
            count += 1

    @_owned
    def _wait_for_message(self, subscriber, timeout):
        """Whether a message of a subscriber without a callback is ready in time."""
        deadline = None if timeout is None else _monotonic() + timeout
        is_over = False
        while not subscriber._is_ready():
            if subscriber._closed or is_over:
                return False
            left = None if deadline is None else deadline - _monotonic()
            is_over = left is not None and left <= 0  # once more, for what has come by now
            if self._run_once(left):
                return False
        return True

    def _note_refusal(self, reply, error):
        if error is not None and error.code != "disconnected" and self._first_refusal is None:
            self._first_refusal = error

    def _set_pose(self, x, y, theta, fixed):
        try:
            x, y, theta = [_real(value, "a pose is three numbers") for value in (x, y, theta)]
        except BadArgument as error:
            raise BadArgument("bad_pose", error.text)
        if not (abs(x) <= _POSE_MAX_M and abs(y) <= _POSE_MAX_M and abs(theta) < 3e38):
            raise BadArgument("bad_pose", "a pose must be finite and within +-32.767 m, not "
                              "%g %g %g" % (x, y, theta))
        if abs(theta) > _WHOLE_TURN_RAD and not self._told_whole_turns:
            self._told_whole_turns = True
            _print_error("the heading of a pose is in radians; %g is more than a whole turn and "
                         "looks like degrees, for which write math.radians(%g) (this is said once; "
                         "whole turns are left out)" % (theta, theta))
        self._tell_not_running()
        self._need_connection()
        body = _float(1, x) + _float(2, y) + _float(3, theta) + (_uint(4, 1) if fixed else b"")
        if self._unanswered_poses() >= _UNREAD_MAX:
            self._wait_until(_monotonic(), lambda: False)  # which only looks
        if self._unanswered_poses() >= _UNREAD_MAX:
            self._next_pose = body  # the newest wins
        else:
            self._next_pose = None
            self._send_pose(body)
            self._write_request()

    def _unanswered_poses(self):
        return sum(done == self._pose_answered for done in self._pending.values())

    def _send_pose(self, body):
        self._request(_bytes(16, body), self._pose_answered)

    def _pose_answered(self, reply, error):
        if error is not None:
            if error.code == "disconnected":
                return
            self._note_refusal(reply, error)
            self._post(("untold", error))
        self._send_next_pose()

    def _send_next_pose(self):
        if self._next_pose is not None:
            body, self._next_pose = self._next_pose, None
            self._send_pose(body)

    def _tell_not_running(self):
        """A callback waits for messages, and the program does other things than to run. Once."""
        if self._heard_nothing_of is None or self._told_not_running or (
                _monotonic() - self._subscribed_at < _RUN_WITHIN_S):
            return
        self._told_not_running = True
        _print_error("%s was subscribed to %d s ago, and run() was not called since: its callback "
                     "is called inside run() and process() only; call run(0.1) in your loop "
                     "instead of time.sleep(0.1)" % (self._heard_nothing_of, _RUN_WITHIN_S))

    def _tell_alone(self):
        """At the end of a program that spoke and listened on a channel and heard nothing at all."""
        if self._has_heard or self._told_alone or self._phase != _UP:
            return
        if self._first_run_at is None or (
                _monotonic() - self._first_run_at < _RUN_WITHIN_S):
            return
        spoken = set(each.label for each in self._handles if isinstance(each, Publisher))
        for each in self._handles:
            if isinstance(each, Subscriber) and each.label in spoken:
                _print_error("nothing was heard on %s: a program does not hear itself; "
                             "swarmtalk-cli neighbours shows which robots are around" % each.label)
                return

    def _learn_the_rest(self):
        """At the end: the last messages may have been refused, which nothing else would tell."""
        for told in self._told.values():
            if told[1]:
                self._tell(told, is_last=True)
        is_up = self._phase == _UP
        is_loss_untold = any(event[0] == "disconnect" for event in self._events)
        has_said = self._has_sent or self._unanswered_poses() > 0
        if not has_said or not (is_up or is_loss_untold):
            return
        try:
            if not is_up:
                raise Error("disconnected", _NOT_CONNECTED)
            self._send_next_pose()
            self._ask(_bytes(17, b""))
        except Error as error:
            if _is_of_a_handler():
                raise
            if error.code in ("timeout", "disconnected"):
                what = "did not answer" if error.code == "timeout" else "was gone"
                self._post(("untold", Error(error.code, "swarmtalkd %s when this program ended: "
                                            "whether its last messages left is not known" % what)))
        if self.on_error != self._print_once_a_second:
            return
        self._tell_left_out()
        failures = []
        for event in self._events:
            if event[0] == "untold":
                failures.append(event[1].text)
            elif event[0] == "sent" and _is_failure(event[2]):
                failures.append("a message was not sent: " + event[2].text)
        for text in sorted(set(failures), key=failures.index):
            times = failures.count(text)
            _print_error(text if times == 1 else "%s (%d times)" % (text, times))
        publishers = [each for each in self._handles if isinstance(each, Publisher)]
        for publisher in publishers:
            while publisher._kept:
                publisher._tell_busy(publisher._kept.popitem()[1].text)
        busy = sum(each._untold_busy for each in publishers)
        if busy:
            _print_error("since then %d more of this program's messages %s not sent" % (
                busy, "was" if busy == 1 else "were"))

    def _tell_not_fetched(self):
        for each in self._handles:
            if isinstance(each, Subscriber) and each._waiting and not each._is_fetched:
                return _print_error(
                    "%s was subscribed to without a function, and its messages were never fetched: "
                    "subscribe(channel, function), or call take() or get() of what subscribe() "
                    "returns" % each.label)

    def _watch_quiet(self):
        """After a while it is looked what may be wrong with channels that were not heard."""
        if self._told_alone or self._phase != _UP or (
                self._quiet_until is not None) or not self._listening():
            return
        self._quiet_until = _monotonic() + _QUIET_S
        self._set_timer(_QUIET_S)

    def _listening(self):
        """The channels that a program waits for; one that answers questions waits for none."""
        return [each for each in self._handles
                if isinstance(each, Subscriber) and each.label != "channel harvest"]

    def _look_around(self):
        def done(reply, error):
            if self._told_alone:
                return
            if error is None and self._tell_misspelt(_record(_STATUS, reply[15]).channels):
                self._told_alone = True
            elif not self._has_heard:
                self._look_who_is_around()
        if not self._told_alone and not all(each._has_heard for each in self._listening()):
            self._request(_bytes(14, b""), done)

    def _tell_misspelt(self, channels):
        """Of a channel that nobody publishes, while another is called nearly so."""
        listening = self._listening()
        ours = [each.label for each in listening]
        names = [_native(each.name) for each in channels
                 if each.name and "channel " + _native(each.name) not in ours]
        in_use = ["channel " + _native(each.name) for each in channels
                  if each.publishers or each.received]
        for each in listening:
            name = each.label[len("channel "):]
            if each._has_heard or each._channel[:1] != b"\x0a" or each.label in in_use:
                continue
            near = _near_channel(name, names)
            if near:
                _print_error("nothing was heard on %s: nobody publishes it as far as this robot "
                             "knows; did you mean '%s'?" % (each.label, near))
                return True
        return False

    def _look_who_is_around(self):
        def done(reply, error):
            if error is not None or self._has_heard or self._told_alone:
                return
            around = [_record(_NEIGHBOUR, value) for number, value
                      in _fields(reply[31], 0, len(reply[31])) if number == 1]
            listening = self._listening()
            if listening and all(each.out_of_range for each in around):
                self._told_alone = True
                _print_error("nothing was heard on %s: no other robot is around, and a program "
                             "does not hear itself; swarmtalk-cli neighbours shows who is heard, "
                             "swarmtalk-cli doctor what is wrong" % listening[0].label)
        self._request(_bytes(30, b""), done)

    def _tell_digits(self, handle):
        """swarmtalk-cli takes digits for a number, so that the two would never meet."""
        name = handle.label[len("channel "):]
        if handle._channel[:1] == b"\x0a" and name.isdigit() and not self._told_digits:
            self._told_digits = True
            _print_error("channel \"%s\" is a name here, and not channel number %s; for the number "
                         "leave out the quotes" % (name, name))

    def _tell_wildcard(self, handle):
        name = handle.label[len("channel "):]
        if self._told_wildcard or not any(letter in name for letter in "#*?+"):
            return
        self._told_wildcard = True
        _print_error("'%s' is the name of one channel: there are no wildcards; use each channel by "
                     "its name, swarmtalk-cli status lists those of this robot's programs" % name)

    def _tell_no_function(self, subscriber):
        """As of subscribe("b", print()), which gives None and hears nothing."""
        if not self._told_no_function:
            self._told_no_function = True
            _print_error("%s: the function that subscribe() got is None; pass the function itself, "
                         "print, not what it returns, print(); to fetch messages without one, "
                         "leave it out" % subscriber.label)

    def _tell_many(self, handle):
        """Handles of one channel that pile up, as in a loop."""
        kind = type(handle)
        count = sum(each.label == handle.label and type(each) is kind for each in self._handles)
        if count < _MANY_HANDLES or (kind, handle.label) in self._told_many:
            return
        self._told_many.add((kind, handle.label))
        word = "subscribe" if kind is Subscriber else "advertise"
        _print_error("%s: %s() was called %d times, and all of them are kept; call it once, before "
                     "the loop, or close() what it returned" % (handle.label, word, count))

    def _look_for_answers(self):
        """That messages have left may have been told, to a program that sends and never runs."""
        inside, me, taken = self._inside, _thread_id(), []
        self._forget_what_was_cut(me)
        if me == inside.thread or me == inside.looker:
            return
        try:
            taken.extend(_filter(None, _map(self._reading.acquire, (False,))))
            if taken:
                inside.looker = me
                self._read()
        finally:
            if taken:
                self._stop_looking()
                if inside.closes:
                    self.close()

    _entrances.add(_look_for_answers.__code__)

    def _publish(self, publisher, payload, ttl, future):
        """Any thread, and any handler of a signal: all that is used here is behind the gate."""
        self._need_own_process()
        if ttl is not None:
            ttl = _number(ttl, "ttl")
        self._has_sent = True
        if self._heard_nothing_of is not None:
            self._tell_not_running()
        if self._thrown_away:
            self._tell_thrown_away()
        if publisher._no_room() is not None or len(publisher._in_flight) > _UNREAD_MAX:
            self._look_for_answers()
        with self._gate:
            number = None
            while number is None:
                refused = self._refusal(publisher, payload, ttl)
                if refused is not None:
                    return refused
                number = self._take_message(publisher, payload, ttl, future)
            self._write()
            is_lost = self._write_error is not None
            if is_lost:
                if number in publisher._in_flight:
                    publisher._in_flight.remove(number)
                publisher._futures.pop(number, None)
            needs_owner = self._outgoing or is_lost
        if needs_owner:
            self._ring()
        return Refused("disconnected", _NOT_CONNECTED) if is_lost else True

    def _refusal(self, publisher, payload, ttl):
        """Why a message is not taken, or None. Inside the gate."""
        if not publisher._id:
            failure = publisher._failure
            return Refused(failure.code, failure.text)
        if len(payload) > publisher.max_message_bytes:
            raise BadArgument("too_long", "the message has %d bytes; %s carries at most %d" % (
                len(payload), publisher.label, publisher.max_message_bytes))
        if ttl is not None and ttl > publisher._max_ttl:
            raise BadArgument("bad_ttl", "a TTL of %d; %s carries at most %d" % (
                ttl, publisher.label, publisher._max_ttl))
        if self._write_error is not None:
            return Refused("disconnected", _NOT_CONNECTED)
        full = publisher._no_room()
        if full is None:
            return None
        self._note_refused(publisher)
        refused = Refused("busy", full)
        unseen = _Unseen(refused, self._thrown_away.append)
        unseen.publisher, unseen.text = publisher, full
        number = id(unseen)
        refused._unseen = publisher._kept[number] = unseen
        return refused

    def _tell_thrown_away(self):
        """Refusals that are gone, and nobody has looked at them."""
        while self._thrown_away:
            try:
                unseen = self._thrown_away.popleft()
            except IndexError:  # another thread was faster
                if _is_of_a_handler():
                    raise
                return
            publisher = getattr(unseen, "publisher", None)  # none of one that a handler cut
            if publisher is not None and publisher._kept.pop(id(unseen), None) is not None:
                publisher._tell_busy(unseen.text)

    def _take_message(self, publisher, payload, ttl, future):
        """Puts a message where it will be written from. Returns its number; None when a handler
        has sent or closed in between. Inside the gate."""
        number, outgoing = publisher._publish_number + 1, self._outgoing
        body = publisher._head + b"\x10" + _varint(number)
        if payload:
            body += b"\x1a" + _varint(len(payload)) + payload
        if ttl is not None:
            body += b"\x20" + _varint(ttl)
        if publisher._tells_time:
            body += b"\x28" + _varint(int(_monotonic() * 1e9))
        frame = _frame(b"\x5a" + _varint(len(body)) + body)
        in_flight, futures = publisher._in_flight, publisher._futures
        if (not publisher._id or publisher._publish_number + 1 != number
                or outgoing is not self._outgoing):
            return None
        publisher._publish_number = number
        if future is not None:
            futures[number] = future
        try:
            in_flight += (number,)
            outgoing += frame
        except BaseException:  # a handler's, before Python 3.10
            if frame not in outgoing:
                _take_back(in_flight, number)
            raise
        return number

    def _note_refused(self, publisher):
        """The daemon counts what is refused here: told in process(), and at most once a second
        here, for a program that only sends. Any thread, inside the gate."""
        publisher._unreported_refused += 1
        now = _monotonic()
        if now - publisher._refused_reported_at < 1 or len(self._outgoing) > _OUTGOING_MAX:
            self._has_unreported_loss = True
            return
        publisher._refused_reported_at = now
        self._report_refused(publisher)
        self._write()
        if self._outgoing or self._write_error is not None:
            self._ring()

    def _report_refused(self, publisher):
        with self._gate:
            refused = publisher._unreported_refused
            if refused and publisher._id:
                frame = _frame(_bytes(19, _uint(3, publisher._id) + _uint(4, refused)))
                outgoing = self._outgoing
                publisher._unreported_refused -= refused
                outgoing += frame


# ---- The Client ---------------------------------------------------------------------------------

_clients = {}  # weak references to all that live, and the descriptors that each has opened


def _close_dropped():
    """What a Client that was dropped without a close() has opened, when the next is made: in what
    Python calls when it collects one, a handler's exception would vanish."""
    for reference in list(_clients):
        if reference() is None:
            for fd in _clients.pop(reference, []):
                if fd is not None:
                    os.close(fd)


_LEFT_OUT = object()  # an argument that was not given, other than None
_SENDS = "a publisher sends: hello = robot.advertise(\"hello\"); hello.send(\"hi\")"
_INSTEAD = {"send": _SENDS, "publish": _SENDS, "id": "did you mean 'node_id'?",
            "sleep": "did you mean 'run'?", "spin": "did you mean 'run'?"}


class Client(_Session):
    """One program's connection to the swarmtalkd of its robot. It reconnects by itself.

    name: of the program, for the daemon's log. socket_path: None: $SWARMTALK_SOCKET, else the
    standard one. connect: False: begin without; the first call that needs the daemon tries, and
    run() goes on trying. Raises Error when connecting fails.
    """

    request_timeout = 1.0
    connect_timeout = 2.0

    def __init__(self, name, socket_path=None, connect=True):
        name = name.decode("utf-8") if isinstance(name, bytes) else name
        if not isinstance(name, _TEXT):
            raise _bad("the name of a Client is text, not %r" % (name,))
        if not name:
            raise _bad("the name of a Client must not be empty; give it the program's: "
                       "Client(\"my_program\")")
        path = "" if socket_path is None else _socket_path(socket_path)
        is_connecting = _flag(connect, "connect")
        self._name = name.encode("utf-8")
        if len(self._name) > _NAME_MAX_BYTES:
            raise _bad("the name of a Client has at most %d bytes" % _NAME_MAX_BYTES)
        self._path = path or os.environ.get("SWARMTALK_SOCKET") or DEFAULT_SOCKET
        self.node_id = 0       # of this robot; 0 before the first connection
        self.daemon_name = ""  # and version
        # Replace these four; None silences one. Called with the Error when the daemon is lost.
        self.on_disconnect = lambda error: _print_error(error.text)
        # Called when there is a daemon again.
        self.on_reconnect = lambda: _print_error("connected to swarmtalkd again")
        self.on_gap = None     # called with a message whose lost_before is not empty, before it
        # Called with the Error of what no call can tell.
        self.on_error = self._print_once_a_second
        self._told = {}  # for each cause of it

        self._pid = os.getpid()
        self._inside = _Inside()
        # A handler may come while its own thread holds one of these.
        self._owner = _RLock()    # of the thread that is inside
        self._reading = _RLock()  # what the owner shares with a send() that looks for room
        self._gate = _RLock()     # what send() of any thread shares with the owner
        self._phase = _DOWN
        self._socket = None
        self._incoming, self._outgoing = bytearray(), bytearray()
        self._write_error = None
        self._wants_write = False
        self._started = self._was_up = self._is_reconnect = self._closed = False
        self._running = self._stopped = False
        self._failure = None            # of the last attempt
        self._reported_failure = None   # its code: the same failure is reported once
        self._backoff = _RECONNECT_FIRST_S
        self._timer_at = None
        self._handles = []
        self._publishers, self._subscribers = {}, {}
        self._registrations_left = 0
        self._adding = None             # the handle that _add() waits for
        self._last_request = 0
        self._pending = {}
        self._first_refusal = None
        self._next_pose = None          # while the answers to many are awaited
        self._events = deque()
        self._left_out = [0, None]      # failures that were too many to keep, and the last one
        self._has_unreported_loss = False
        self._thrown_away = deque()     # _Unseen of what is gone
        self._log = None
        self._loop = None
        self._heard_nothing_of = None   # a subscription with a callback, until process() is called
        self._subscribed_at = 0         # when that was
        self._told_not_running = self._told_whole_turns = False
        self._told_many = set()         # labels of channels
        self._told_wildcard = self._told_digits = self._told_alone = self._told_nobody = False
        self._told_log_off = False
        self._told_no_function = False
        self._quiet_until = None        # on this connection
        self._has_heard = False         # any message
        self._has_sent = False
        self._first_run_at = None

        self._rung = False
        self._epoll = self._timer = self._wake_read = self._wake_write = None
        self._opened = [None]           # descriptors to close; empty when that is done
        try:
            self._open_descriptors()
            _close_dropped()
            _clients[weakref.ref(self)] = self._opened
            if is_connecting:
                self.connect()
        except BaseException:
            self.close()
            raise

    def _open_descriptors(self):
        if not hasattr(select, "epoll"):
            raise Error("unsupported", "gevent or eventlet has taken select.epoll away, which "
                        "swarmtalk needs: call gevent's patch_all(select=False), or eventlet's "
                        "monkey_patch(select=False), instead")
        try:
            self._epoll = select.epoll()
            _open_timer(self._opened)
            next(_map(self._opened.extend, iter(os.pipe, None)))  # made and noted in one call
            self._timer, self._wake_read, self._wake_write = self._opened[1:]
            for fd in self._opened[2:]:
                _libc.fcntl(fd, 4, os.O_NONBLOCK)  # F_SETFL
                _libc.fcntl(fd, 2, 1)              # F_SETFD, FD_CLOEXEC
            self._epoll.register(self._timer, select.EPOLLIN)
            self._epoll.register(self._wake_read, select.EPOLLIN)
        except (OSError, IOError) as error:
            if _is_of_a_handler():
                raise
            raise Error("system", "cannot make a Client: " + _why(error.errno))
        self._ring()

    def __enter__(self):
        return self

    def __exit__(self, *unused):
        self.close()

    def __setattr__(self, name, value):
        if name[0] != "_" and name not in ("node_id", "daemon_name"):
            self._check_attribute(name, value)
        object.__setattr__(self, name, value)

    @staticmethod
    def _check_attribute(name, value):
        """A program may keep values of its own here, but not what is nearly the name of ours."""
        known = ("on_disconnect", "on_reconnect", "on_gap", "on_error", "request_timeout",
                 "connect_timeout")
        if name not in known:
            import difflib
            if name.startswith("on_") or difflib.get_close_matches(name, known, 1, 0.8):
                raise AttributeError("a Client has no %r; %s" % (
                    name, "messages are handed to the function that subscribe(channel, function) "
                    "gets" if difflib.get_close_matches(name, ("on_message", "on_receive"), 1, 0.8)
                    else _near(name, known, "it has " + ", ".join(known))))
        elif name in ("request_timeout", "connect_timeout"):
            _real(value, name + " must be a number of seconds")
        elif name == "on_reconnect" and value is not None and not callable(value):
            raise _bad("on_reconnect must be a function, or None, not %r" % (value,))
        elif name != "on_reconnect" and value is not None:
            _taking_one(value, name, "message" if name == "on_gap" else "error")

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        raise AttributeError("a Client has no %r; %s" % (name, _INSTEAD.get(name) or _near(
            name, [each for each in dir(type(self)) if each[0] != "_"] + ["node_id"],
            "docs/python.md lists what it has")))

    # -- What a program calls.

    @_owned
    def connect(self):
        """Waits until connected, at most connect_timeout; runs no callback. Raises Error."""
        self._connect()

    def _connect(self):
        self._need_open()
        if self._phase == _UP:
            return
        deadline = _monotonic() + self.connect_timeout
        inside = self._inside
        try:
            inside.connecting = True
            self._mend()
            if self._phase == _DOWN:
                self._attempt()
            self._wait_until(deadline, lambda: self._phase == _UP or (
                self._phase == _DOWN and self._failure and self._failure.code != "timeout"))
        finally:
            inside.connecting = False
        if self._phase != _UP:
            failure = self._failure or self._no_answer()
            self._reported_failure = failure.code
            raise failure

    @property
    def connected(self):
        """Whether there is a daemon now."""
        return self._phase == _UP

    @_owned
    def advertise(self, channel, ttl=None, timestamped=None, queue=DEFAULT_QUEUE,
                  drop_oldest=False, repeat=1, repeat_interval=None, sent=None, redundancy=0):
        """A Publisher on a channel, by name or number.

        ttl: hops after the first. queue: so many messages wait behind the one on its way; then
        send() is refused, or with drop_oldest the oldest that waits is dropped. repeat: each
        message is sent so often, repeat_interval seconds apart, and heard once. redundancy: each
        message arrives though any so many of its packets are lost, at most 12; "auto": as many as
        the loss around demands; the publisher's has_redundancy says whether it is so. timestamped:
        carries its delay; all programs of the channel must agree. sent(error): called for each
        message, with None when it has left, else with the Error why it never will; True: needed
        for async_send().
        """
        return self._add(Publisher(self, channel, ttl, timestamped, queue, drop_oldest, repeat,
                                   repeat_interval, sent, redundancy))

    @_owned
    def subscribe(self, channel, receive=_LEFT_OUT, within=None, known_distance_only=False,
                  keep_last=None, latest_from_each=False, no_older_than=None, timestamped=None):
        """A Subscriber of a channel, by name or number.

        receive(message): called inside process() and run(); without, messages are fetched from the
        Subscriber. within: only from so many metres; what has no distance comes too, unless
        known_distance_only. keep_last: so many wait while the program is busy, the oldest goes
        first; latest_from_each: of these only the newest of each sender. no_older_than: what is
        older, in seconds, when its turn comes is dropped.
        """
        function = None if receive is _LEFT_OUT else receive
        subscriber = Subscriber(self, channel, function, within, known_distance_only, keep_last,
                                latest_from_each, no_older_than, timestamped)
        if receive is None:
            self._tell_no_function(subscriber)
        return self._add(subscriber)

    @_owned
    def set_pose(self, x, y, theta):
        """Tells where this robot is now; it ages from here. The newest of all programs counts."""
        self._set_pose(x, y, theta, False)

    @_owned
    def set_fixed_pose(self, x, y, theta):
        """The same of a robot that stands still: the pose does not age."""
        self._set_pose(x, y, theta, True)

    @_owned
    def get_pose(self):
        """This robot's Pose as the daemon knows it; None when it is missing or stale."""
        return _pose(self._ask(_bytes(17, b""))[18])

    @_owned
    def neighbours(self):
        """The robots heard within the last 10 s: [Neighbour]. One whose programs send nothing is
        heard only with beacon_ms in its configuration; the first time that none is heard, stderr
        says so."""
        reply = self._ask(_bytes(30, b""))[31]
        found = [_record(_NEIGHBOUR, value, Neighbour)
                 for number, value in _fields(reply, 0, len(reply)) if number == 1]
        if not found and not self._told_nobody:
            self._told_nobody = True
            _print_error("no robot was heard within the last 10 s: one whose programs send nothing "
                         "is heard only with beacon_ms in its configuration")
        return found

    @_owned
    def status(self):
        """What the daemon tells of itself: version, links, channels, programs, counters."""
        status = _record(_STATUS, self._ask(_bytes(14, b""))[15])
        status.counters = dict(status.counters)
        return status

    @_owned
    def sync(self):
        """Waits until the daemon has answered all that was asked. Raises the first refusal."""
        self._need_connection()
        done = self._wait_until(_monotonic() + self.request_timeout,
                                lambda: not self._pending and self._next_pose is None)
        refusal, self._first_refusal = self._first_refusal, None
        if not done:
            raise Error("timeout", "swarmtalkd did not answer in time")
        if refusal is not None:
            raise refusal
        self._need_connection()

    def log(self, line):
        """Sends a line to whoever listens to channel debug (`swarmtalk-cli log`), over a few hops.

        Returns as send() does; the first call waits until the channel is registered. While the
        daemon's configuration has it off: False, and stderr says so once.
        """
        error = self._open_log()
        if error is None:
            return self._log.send(line)
        if not self._told_log_off:
            self._told_log_off = True
            _print_error("log lines stay on this robot: " + error.text)
        return False

    def _open_log(self):
        """Why the channel debug is off on this robot; None: it is on."""
        if self._log is None:
            try:
                self._log = self.advertise("debug", ttl=4, queue=16, drop_oldest=True,
                                           sent=lambda error: None)
            except Error as error:
                if error.code != "bad_channel":
                    raise
                return error
        return None

    # -- Event loops.

    def fileno(self):
        """For an event loop of your own: readable when process() has work, also while there is no
        daemon. Stays the same. Do not read or close it."""
        self._need_own_process()
        return self._epoll.fileno()

    @_owned
    def process(self):
        """Does all that waits: reads, calls callbacks, reconnects. Never waits itself.

        Returns whether there is a daemon."""
        return self._process()

    def _process(self):
        self._need_open()
        inside = self._inside
        if inside.processing:
            raise _bad("process(), run() and waiting for messages make no sense inside a callback")
        done = False
        try:
            inside.processing = True
            self._heard_nothing_of = None
            self._tell_thrown_away()
            if self._first_run_at is None:
                self._first_run_at = _monotonic()
            if self._rung:
                self._rung = False
                self._drain_pipe()
            if not self._started:
                self._attempt_in_background()
            self._mend()
            self._take_timer()
            self._run_events()
            for _ in range(_READS_AHEAD):
                if not self._read() or len(self._events) >= _EVENTS_MAX // 4:
                    break
            self._flush()
            self._run_events()
            self._report_losses()
            self._watch_quiet()
            self._flush()
            done = True
        finally:
            inside.processing = False
            if not done or self._outgoing and not self._wants_write:
                self._ring()  # a callback threw, or a handler has sent: there is more to do
        return self._phase == _UP

    @_owned
    def run(self, seconds=None):
        """process() in a loop: for ever, for a time, or until stop()."""
        seconds = _timeout(seconds, "seconds")
        deadline = None if seconds is None else _monotonic() + seconds
        was_running, self._running = self._running, True
        try:
            while True:
                self._process()
                if self._take_stop():
                    return
                left = None if deadline is None else deadline - _monotonic()
                if left is not None and left <= 0:
                    return
                self._poll(left)
        finally:
            self._running = was_running

    run_for = run

    @_owned
    def run_once(self, timeout=None):
        """Waits for something to do, at most `timeout` seconds, and does it once."""
        self._run_once(_timeout(timeout, "timeout"))

    def stop(self):
        """Makes the running run() or wait, or else the next, return. Any thread, also in the
        handler of a signal. In a child of fork() it does nothing."""
        if os.getpid() == self._pid:
            self._stopped = True
            self._ring()

    @_owned
    def attach(self, loop=None):
        """In asyncio: process() is called by the event loop from now on. Returns the loop.

        A Client that was attached to a loop that has ended goes over to the new one."""
        loop = loop or self._running_loop()
        if loop is self._loop or self._closed:
            return loop
        if self._loop is not None:
            if self._loop.is_running():
                raise _bad("this Client is attached to another event loop, which is running; make "
                           "a Client for each loop")
            if not self._loop.is_closed():
                self._loop.remove_reader(self.fileno())
            for handle in self._handles:
                handle._futures.clear()  # nobody waits for them any more
        self._loop = loop
        loop.add_reader(self.fileno(), self.process)
        return loop

    def _running_loop(self):
        """The event loop that runs, else the one of before."""
        import asyncio
        try:
            return getattr(asyncio, "get_running_loop", asyncio.get_event_loop)()
        except RuntimeError:
            if self._loop is not None and not self._loop.is_closed():
                return self._loop
            raise _bad("attach(), `async for` and async_send() need a running event loop: call "
                       "them in a coroutine, and start it with asyncio.run()")

    def close(self):
        """Ends the connection and everything registered. No callback is called after this.

        In the handler of a signal that came in the middle of another call, run() say, that call
        is ended first. In a child of fork() it does nothing."""
        if self._closed and not self._opened or os.getpid() != self._pid:
            return
        inside = self._inside
        self._forget_what_was_cut(_thread_id())
        if inside.is_cut_by(_thread_id()):
            inside.closes = True
            self.stop()
        else:
            inside.closes = False
            self._close()

    @_owned
    def _close(self):
        if not self._closed:
            self._say_last_words()
        self._closed = True
        # What a handler cuts from here on, another close() does.
        if self._loop is not None and not self._loop.is_closed():
            self._loop.remove_reader(self.fileno())
        with self._gate:
            self._phase = _DOWN
            gone = Error("disconnected", "the Client of this handle is closed")
            for handle in self._handles:
                handle._id, handle._failure, handle._closed = 0, gone, True
        self._release_socket()
        for handle in self._handles:
            if isinstance(handle, Subscriber):
                handle._serve_futures()
            else:
                handle._end_futures()
        self._handles = []
        self._events.clear()
        self._pending.clear()
        if self._epoll is not None:
            self._epoll.close()
        with self._gate:
            self._wake_write = None
            deque(map(os.close, iter(self._opened.pop, None)), 0)  # each once, all in one call

    def _say_last_words(self):
        self._tell_thrown_away()
        if self._phase == _UP:
            self._has_unreported_loss = True
            self._report_losses()
            self._flush()
        if self._heard_nothing_of is not None and self._started and not self._told_not_running:
            _print_error("%s was subscribed to and nothing was heard: call run() or process(): "
                         "callbacks run only inside those" % self._heard_nothing_of)
        self._tell_alone()
        self._learn_the_rest()
        self._tell_not_fetched()


_ending = []  # not empty: the program has ended


@atexit.register
def _close_all():
    _ending.append(True)
    for client in [reference() for reference in list(_clients)]:
        try:
            if client is not None:
                client.close()
        except BadArgument:  # a thread of the program's is still inside: it ends with the process
            pass


# ---- Harvest ------------------------------------------------------------------------------------

class HarvestedValue(Record):
    """One value of one program of a robot: node_id, epoch, hops, local, key, value (text), data
    (the value's bytes)."""


class Harvest(object):
    """Values of this program for whoever asks, and questions for those of others, over hops.

    Speaks on the reserved channel "harvest", which the daemon's configuration must switch on.
    """

    MAX_KEY_BYTES, MAX_VALUE_BYTES, MAX_VALUES, DEFAULT_TTL = 64, 512, 64, 4
    _ANSWER_BYTES = 1000  # of one message; more values go into more messages

    def __init__(self, client):
        if not isinstance(client, Client):
            raise _bad("Harvest takes the program's Client: swarmtalk.Harvest(robot), not %r"
                       % (client,))
        self._values = {}
        self._found = None
        self._question = 0
        self._publisher = client.advertise("harvest", queue=16, drop_oldest=True,
                                           sent=lambda error: None)
        self._subscriber = client.subscribe("harvest", self._hear)
        client._heard_nothing_of = None

    def set(self, key, value):
        """From now on this value, bytes or text, answers questions for `key`."""
        key, value = _payload(key, "a key"), _payload(value, "a value")
        if not 1 <= len(key) <= self.MAX_KEY_BYTES:
            raise _bad("the key of a value has 1 to %d bytes, not %d"
                       % (self.MAX_KEY_BYTES, len(key)))
        if len(value) > self.MAX_VALUE_BYTES:
            raise _bad("a value has at most %d bytes, not %d" % (self.MAX_VALUE_BYTES, len(value)))
        if key not in self._values and len(self._values) >= self.MAX_VALUES:
            raise _bad("a program sets at most %d values; remove one" % self.MAX_VALUES)
        self._values[key] = value

    def remove(self, key):
        """The value answers no more."""
        self._values.pop(_payload(key), None)

    def ask(self, prefix, found, ttl=DEFAULT_TTL):
        """Asks all robots within `ttl` hops after the first for values whose keys begin with
        `prefix`. found(HarvestedValue) is called for each answer, until the next ask(). Answers
        may be lost: ask again. Returns as send() does."""
        _taking_one(found, "found", "value")
        ttl = _number(ttl, "ttl", 0, 255)
        self._question = random.randint(1, 0xFFFFFFFF)
        self._found = found
        return self._publisher.send(struct.pack(">cIB", b"Q", self._question, ttl)
                                    + _payload(prefix), ttl)

    def close(self):
        """Ends it; its values answer no more."""
        self._publisher.close()
        self._subscriber.close()

    def _hear(self, message):
        data = message.data
        if len(data) >= 6 and data[:1] == b"Q":
            question, ttl = struct.unpack(">IB", data[1:6])
            self._answer(question, ttl, data[6:])
        elif self._found is not None and data[:5] == struct.pack(">cI", b"A", self._question):
            found = self._found  # which may ask anew
            for key, value in self._values_of(data[5:]):
                found(HarvestedValue(
                    node_id=message.sender, epoch=message.epoch, hops=message.hops,
                    local=message.local, key=_text(key), value=_text(value), data=value))

    @staticmethod
    def _values_of(data):
        """The values of an answer; of one that is cut, those before the cut."""
        while data:
            size = struct.unpack(">B", data[:1])[0]
            if size == 0 or len(data) < 1 + size + 2:
                return
            value_size = struct.unpack(">H", data[1 + size:3 + size])[0]
            end = 3 + size + value_size
            if len(data) < end:
                return
            yield data[1:1 + size], data[3 + size:end]
            data = data[end:]

    def _answer(self, question, ttl, prefix):
        empty = struct.pack(">cI", b"A", question)
        most = min(self._ANSWER_BYTES, self._publisher.max_message_bytes)
        answer = empty
        for key in sorted(self._values):
            if not key.startswith(prefix):
                continue
            value = self._values[key]
            each = (struct.pack(">B", len(key)) + key + struct.pack(">H", len(value)) + value)
            if len(answer) > len(empty) and len(answer) + len(each) > most:
                self._publisher.send(answer, min(ttl, self._publisher._max_ttl))
                answer = empty
            answer += each
        if len(answer) > len(empty):
            self._publisher.send(answer, min(ttl, self._publisher._max_ttl))


# ---- Scripts written for Coachbots --------------------------------------------------------------

class _Id(int):
    """A number that may be called: `robot.virtual_id` and `robot.virtual_id()` are both in use."""

    def __call__(self):
        return int(self)


class Robot(object):
    """What a script `usr(robot)` gets: the calls of a Coachbot, over swarmtalkd.

    Calls that are not here go to the robot that was wrapped; without one (on a laptop, in the lab)
    time and pose come from here and from the daemon, and motors and LED do nothing. `swarm` is the
    Client, for all that Coachbots do not have.
    """

    _POSE_EVERY_S = 0.02  # asking coach-os for the pose takes up to 3 ms

    def __init__(self, robot, client, channel="coachbot", within=None):
        self.swarm = client  # the Client, for all that Coachbots do not have
        self._robot = robot
        self._started = _monotonic()
        self._pose, self._pose_asked_at = None, -1e9
        self._missing = set()
        self._bad_pose_told = False
        self._dropped, self._untold_drops, self._told_drops_at = 0, 0, -1e9
        self._looked_at = 0
        self._publisher = client.advertise(channel, queue=16, drop_oldest=True,
                                           sent=self._count_dropped)
        self._subscriber = client.subscribe(channel, within=within)
        self._subscriber._is_fetched = True  # a script that only sends is right, too

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        if self._robot is not None:
            self._feed_pose()
            return getattr(self._robot, name)
        if name not in ("set_vel", "set_led", "signal"):
            raise AttributeError("a Coachbot's robot has no %r; swarmtalk has more in robot.swarm"
                                 % name)
        if name not in self._missing:
            self._missing.add(name)
            _print_error("no Coachbot here: robot.%s() does nothing" % name)
        return lambda *arguments, **options: True

    def send_msg(self, msg):
        """Sends exactly these bytes to all robots around; never waits. Returns whether it was
        taken. Raises BadArgument, where a Coachbot truncates."""
        self._feed_pose()
        taken = bool(self._publisher.send(msg))
        now = _monotonic()
        if now - self._looked_at > 0.1 and self.swarm._inside.thread != _thread_id():
            self._looked_at = now
            self.swarm.process()  # a script that only sends is told of what is dropped, too
        return taken

    @property
    def dropped(self):
        """Messages of send_msg() that never left, because newer ones took their place."""
        return self._dropped

    def _count_dropped(self, error):
        if error is None or error.code != "dropped":
            return
        self._dropped += 1
        self._untold_drops += 1
        now = _monotonic()
        if now - self._told_drops_at < 1:
            return
        self._told_drops_at = now
        count, self._untold_drops = self._untold_drops, 0
        _print_error("send_msg(): %d message%s dropped for newer ones, because the script sends "
                     "faster than they leave; wait with robot.delay(50) between them"
                     % (count, " was" if count == 1 else "s were"))

    def recv_msg(self, clear=False):
        """The messages since the last call, each exactly as it was sent: [bytes]."""
        return [message.data for message in self.recv()]

    def recv(self):
        """The same as Message objects, with sender, distance, bearing: [Message]."""
        self._feed_pose()
        return self._subscriber.take()

    def get_pose(self):
        """(x, y, theta), the last that is known; None before the first. Whether it is new since
        the last call does not matter, as it does on a Coachbot alone."""
        self._feed_pose(0)
        if self._robot is not None:
            return self._pose
        pose = self.swarm.get_pose()
        return None if pose is None else (pose.x, pose.y, pose.theta)

    def get_pose_blocking(self):
        """The same, waiting until it is known."""
        while True:
            pose = self.get_pose()
            if pose is not None:
                return pose
            self.delay(20)

    def get_clock(self):
        """Seconds since the program started; not the same on two robots."""
        self._feed_pose()
        if self._robot is not None:
            return self._robot.get_clock()
        return _monotonic() - self._started

    def delay(self, ms=20):
        """Waits so many milliseconds."""
        self._feed_pose()
        if self._robot is not None:
            self._robot.delay(ms)
        else:
            self.swarm.run(max(ms, 0) / 1000.0)
        self._feed_pose()

    @property
    def virtual_id(self):
        """This robot's number, as attribute and as call: coach-os's, else the node id."""
        own = getattr(self._robot, "virtual_id", None)
        own = own() if callable(own) else own
        return _Id(self.swarm.node_id if own is None else own)

    @property
    def id(self):
        """The physical number: coach-os's, else the node id."""
        own = getattr(self._robot, "id", None)
        own = own() if callable(own) else own
        return _Id(self.swarm.node_id if own is None or own < 0 else own)

    @property
    def logger(self):
        """coach-os's logger, else Python's, which writes to stderr from INFO on unless the script
        has set up logging itself."""
        own = getattr(self._robot, "logger", None)
        if own is not None:
            return own
        import logging
        logger = logging.getLogger("usr")
        if not logger.handlers and not logging.getLogger().handlers:
            handler = logging.StreamHandler()
            handler.setFormatter(logging.Formatter("%(levelname)s: %(message)s"))
            logger.addHandler(handler)
            logger.setLevel(logging.INFO)
        return logger

    def _feed_pose(self, every=_POSE_EVERY_S):
        """Tells the daemon where the robot is, when it has a new pose (get_pose() of a Coachbot
        gives each once)."""
        now = _monotonic()
        if self._robot is None or now - self._pose_asked_at < every:
            return
        self._pose_asked_at = now
        pose = self._robot.get_pose()
        if not pose:
            return
        self._pose = pose
        try:
            self.swarm.set_pose(*pose[:3])
        except Error as error:
            # No reason to end a script; a lost daemon was told already.
            if error.code != "disconnected" and not self._bad_pose_told:
                self._bad_pose_told = True
                _print_error("the pose %r is not passed on: %s" % (pose, error.text))


def wrap(robot=None, channel="coachbot", within=None, name="usr_code"):
    """The robot of a Coachbot script with swarmtalkd behind it. Raises Error without a daemon.

    robot: coach-os's, or None where there is none. channel: of send_msg() and recv_msg().
    within: messages from farther, in metres, are not heard.

    An exception that ends the program goes to the debug channel, as with run_script(). One that
    the caller of usr() catches, or of another thread, cannot be seen from here: run_script()
    reports it.
    """
    wrapped = Robot(robot, Client(name), channel, within)
    _open_debug(wrapped.swarm)
    _tell_swarm_at_death(wrapped.swarm, name)
    return wrapped


_LINES_OF_A_TRACEBACK = 15


def _open_debug(client):
    """Gets the debug channel ready for what kills the script; says when it is off."""
    try:
        off = client._open_log()
    except Error as error:
        _print_error(error.text)
        return
    if off is not None:
        client._told_log_off = True
        _print_error("a traceback stays on this robot: " + off.text)


def _tell_swarm(client, name, kind, error, calls):
    """Sends a traceback to the debug channel line by line and waits, a second at most, until it has
    left."""
    if client._log is None:
        return
    lines = "".join(traceback.format_exception(kind, error, calls)).split("\n")
    lines = [line for line in lines if line.strip()][-_LINES_OF_A_TRACEBACK:]
    try:
        for line in ["%s died on robot %d:" % (name, client.node_id)] + lines:
            client.log(line)
        deadline = _monotonic() + 1
        while client._log._in_flight and _monotonic() < deadline:
            client.run_once(0.1)
    except Error as error:
        _print_error("the traceback could not be sent to the other robots: " + error.text)


def _tell_swarm_at_death(client, name):
    """The same for an exception that ends the program, after what is done about it anyway."""
    before = sys.excepthook
    client = weakref.ref(client)

    def tell(kind, error, calls):
        before(kind, error, calls)
        alive = client()
        if alive is not None and not alive._closed and issubclass(kind, Exception):
            _tell_swarm(alive, name, kind, error, calls)
    sys.excepthook = tell


def _wide_encoding(source):
    """UTF-16 or UTF-32, if a file is in that, as some editors of Windows save it; else nothing."""
    zeros = [byte == 0 for byte in bytearray(source[:4])]
    if (zeros in ([False, True, True, True], [True, True, True, False])
            or source[:4] in (b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        return "UTF-32"
    if (zeros in ([False, True] * 2, [True, False] * 2)
            or source[:2] in (b"\xff\xfe", b"\xfe\xff")):
        return "UTF-16"
    return ""


def run_script(path, robot=None, channel="coachbot", within=None):
    """Runs a Coachbot script, a file with `usr(robot)`, as it is. Returns when usr() does.

    What kills the script is printed, goes to the debug channel line by line, where `swarmtalk-cli
    log` shows it on any robot, and is raised again. A file that cannot be read raises IOError, one
    in UTF-16 BadArgument, before anything is asked of the daemon.
    """
    with open(path, "rb") as file:
        source = file.read()
    if _wide_encoding(source):
        raise _bad("%s is %s; save it as UTF-8" % (path, _wide_encoding(source)))
    name = os.path.basename(path)
    wrapped = Robot(robot, Client(name), channel, within)
    client = wrapped.swarm
    _open_debug(client)
    try:
        namespace = {"__name__": "usr_code", "__file__": path}
        code = compile(source, path, "exec", 0, True)  # without our own print_function
        exec(code, namespace)
        if "usr" not in namespace:
            raise _bad("%s has no function usr(robot)" % path)
        namespace["usr"](wrapped)
    except Exception:
        kind, error, calls = sys.exc_info()
        _tell_swarm(client, name, kind, error, calls.tb_next)
        raise
    finally:
        client.close()


def _print_traceback():
    """What the interpreter prints of an exception, without the calls of this file that led to the
    script; a mistake that was found here is a sentence."""
    kind, error, calls = sys.exc_info()
    while calls is not None and calls.tb_frame.f_globals is globals():
        calls = calls.tb_next
    if calls is None and isinstance(error, Error):
        return _print_error(error.text)
    traceback.print_exception(kind, error, calls)


def main(arguments=None):
    """swarmtalk-run [--python PROGRAM] [--channel NAME] [--within METRES] SCRIPT"""
    import argparse

    class Parser(argparse.ArgumentParser):
        """Reports what is wrong in one line."""

        def error(self, message):
            see = " See" if message.endswith("?") else "; see"
            self.exit(2, "%s: %s%s %s --help\n" % (self.prog, message, see, self.prog))

        def parse_known_args(self, args=None, namespace=None):
            """Reports a word that is not known; a value after such an option is none."""
            options, words = argparse.ArgumentParser.parse_known_args(self, args, namespace)
            for word in sorted(words, key=lambda word: not word.startswith("-")):
                if not word.startswith("-"):
                    self.error("%r is one word too many" % _native(word))
                name = word.split("=")[0]
                near = _near(name, list(self._option_string_actions), "")
                self.error("there is no option '%s'%s" % (name, near and "; " + near))
            return options, []
    parser = Parser(
        prog="swarmtalk-run", description="Runs a Coachbot script, a file with usr(robot), as it "
        "is, with the swarmtalkd of this robot behind send_msg() and recv_msg().")
    parser.add_argument("--python", help="of another version, such as python2.7")
    parser.add_argument("--channel", default="coachbot", help="of the messages (%(default)s)")
    parser.add_argument("--within", type=float, metavar="METRES",
                        help="do not hear robots that are farther away")
    parser.add_argument("-V", "--version", action="version", version=__version__)
    parser.add_argument("script")
    options = parser.parse_args(arguments)
    if options.python:
        command = [options.python, os.path.abspath(__file__), "--channel", options.channel]
        if options.within is not None:
            command += ["--within", repr(options.within)]
        try:
            os.execvp(command[0], command + [options.script])
        except OSError as error:
            _print_error("%s cannot be started: %s" % (options.python, error.strerror))
            return 2
    try:
        run_script(options.script, None, options.channel, options.within)
    except (KeyboardInterrupt, SystemExit) as end:
        return end.code if isinstance(end, SystemExit) else 130
    except IOError as error:
        if error.filename != options.script:
            _print_traceback()
            return 1
        _print_error("cannot read %s: %s" % (options.script, error.strerror))
        return 2
    except Error as error:
        if error.code not in ("no_daemon", "daemon_dead", "no_permission", "version_mismatch"):
            _print_traceback()
            return 1
        _print_error(error.text)
        return 3
    except Exception:
        _print_traceback()
        return 1
    return 0


if __name__ == "__main__":
    sys.modules["swarmtalk"] = sys.modules["__main__"]  # for a script that imports it
    sys.exit(main())
