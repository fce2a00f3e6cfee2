"""The daemon's answers as the Python client hands them on, against ipc/ipc.proto: each field gets
another value, and must come back under its own name, in seconds where the protocol has
milliseconds."""
import pathlib
import re
import struct

import pytest

import swarmtalk
from local_frames import field, varint
from scripted_daemon import ADVERTISE, advertised

pytestmark = pytest.mark.logic

PROTOCOL = (pathlib.Path(__file__).resolve().parents[2] / "ipc/ipc.proto").read_text()
NAMES = {"clients_served": "programs", "distance_m": "distance", "bearing_rad": "bearing",
         "age_ms": "age", "uptime_ms": "uptime"}
# For swarmtalk-cli doctor and people who look.
NOT_HANDED_ON = {
    "Neighbour": {"signal_dbm", "loss_frames"}, "ChannelStatus": set(), "ClientStatus": set(),
    "Status": {"users"},
    "LinkStatus": {"interface", "ethertype", "sealed", "air_rate_mbps", "asked_buffer_bytes",
                   "given_buffer_bytes", "packet_limit_bytes", "forward_jitter_us"}}


def declared(message):
    """[(is_repeated, type, name, number)] of a message of the protocol."""
    body = re.search(rf"^message {message} {{(.*?)^}}", PROTOCOL, re.M | re.S)[1]
    found = re.findall(r"^  (optional |repeated )?(\w+) (\w+) = (\d+);", body, re.M)
    assert len(found) > 1, message
    return [(label == "repeated ", kind, name, int(number))
            for label, kind, name, number in found]


class Encoder:
    """Makes messages, and what a program should see of them."""

    def __init__(self):
        self.count = 100

    def of_field(self, kind, name, number):
        """(bytes, what a program sees)"""
        self.count += 1
        count = self.count
        if kind in ("uint32", "uint64"):
            return field(number, count), count / 1000 if name.endswith("_ms") else count
        if kind == "bool":
            return field(number, 1), True
        if kind == "float":
            return varint(number << 3 | 5) + struct.pack("<f", count), float(count)
        if kind == "string":
            return field(number, f"{name} {count}"), f"{name} {count}"
        if kind == "Pose":
            parts = b"".join(varint(each << 3 | 5) + struct.pack("<f", count + each)
                             for each in (1, 2, 3))
            return (field(number, parts + field(4, count)),
                    swarmtalk.Pose(count + 1, count + 2, count + 3, count / 1000))
        if kind == "Counter":
            return (field(number, field(1, f"counter {count}") + field(2, count)),
                    (f"counter {count}", count))
        parts, seen = self.of_message(kind)
        return field(number, parts), seen

    def of_message(self, message):
        encoded, seen = b"", {}
        for is_repeated, kind, name, number in declared(message):
            if name in NOT_HANDED_ON[message]:
                continue
            several = [self.of_field(kind, name, number) for _ in range(2 if is_repeated else 1)]
            encoded += b"".join(each[0] for each in several)
            values = [each[1] for each in several]
            if kind == "Counter":
                values = dict(values)
            seen[NAMES.get(name, name)] = values if is_repeated else values[0]
        return encoded, seen


def plain(value):
    if isinstance(value, swarmtalk.Record):
        return {name: plain(each) for name, each in vars(value).items()}
    return [plain(each) for each in value] if isinstance(value, list) else value


@pytest.mark.parametrize("message, table", [("Status", swarmtalk._STATUS),
                                            ("Neighbour", swarmtalk._NEIGHBOUR)])
def test_each_field_comes_back_as_the_protocol_has_it(message, table):
    encoded, seen = Encoder().of_message(message)
    record = plain(swarmtalk._record(table, bytearray(encoded)))
    if message == "Status":
        record["counters"] = dict(record["counters"])  # the Client does this
    assert record == seen


@pytest.mark.parametrize("table", [swarmtalk._STATUS, swarmtalk._NEIGHBOUR, swarmtalk._LINK,
                                   swarmtalk._CHANNEL, swarmtalk._PROGRAM])
def test_what_is_not_told_is_nothing_or_not_known(table):
    for name, value in vars(swarmtalk._record(table, bytearray())).items():
        if name in ("distance", "bearing"):
            assert value != value, name
        elif name == "pose":
            assert value is None
        else:
            assert not value and value is not None, name


def test_a_record_names_what_it_has():
    record = swarmtalk._record(swarmtalk._NEIGHBOUR, bytearray(field(2, 9)), swarmtalk.Neighbour)
    assert repr(record).startswith("Neighbour(address='', age=0.0, ")
    assert "node_id=9" in repr(record)
    with pytest.raises(AttributeError, match="a Neighbour has no 'distanc'; did you mean "
                                             "'distance'"):
        record.distanc
    with pytest.raises(AttributeError, match="a Record has no 'xyzzy'; it has node, sender"):
        swarmtalk.Record(sender=1, node=2).xyzzy
    with pytest.raises(AttributeError, match="^_mine$"):
        record._mine


def test_a_message_names_what_it_has():
    message = swarmtalk.Message([(2, b"hi"), (4, 9), (6, 1.5)])
    assert repr(message) == "Message(b'hi', sender=9, distance=1.50)"
    for name, words in (("payload", "did you mean 'data'"), ("sendr", "did you mean 'sender'"),
                        ("ag", "did you mean 'age'"), ("xyzzy", "it has data, channel")):
        with pytest.raises(AttributeError, match="a Message has no %r; %s" % (name, words)):
            getattr(message, name)
    with pytest.raises(AttributeError, match="^_mine$"):
        message._mine


def test_the_age_of_a_message_is_what_has_passed_and_its_delay(monkeypatch):
    monkeypatch.setattr(swarmtalk, "_monotonic", lambda: 100.0)
    received, delay = (12, 98500000000), (11, 250000)
    assert swarmtalk.Message([received]).age == 1.5
    assert swarmtalk.Message([received, delay]).age == 1.75
    alone = swarmtalk.Message([delay])
    assert alone.age != alone.age and alone.delay == 0.25
    assert swarmtalk.Message([received, delay]).received_at == 98.5


def test_what_is_known_of_a_place():
    known, unknown = swarmtalk.Message([(6, 0.0), (7, 0.0)]), swarmtalk.Message([])
    assert (known.has_distance, known.has_bearing) == (True, True)
    assert (unknown.has_distance, unknown.has_bearing) == (False, False)
    assert not unknown.distance < 1e9 and not unknown.bearing > -1e9
    near, far = swarmtalk.Message([(6, 1.0)]), swarmtalk.Message([(7, 1.0)])
    assert (near.has_bearing, far.has_distance) == (False, False)


def test_losses_are_added_place_by_place():
    lost = swarmtalk.Loss(1, 2, 3, 4, 5)
    assert lost.total == 10, "what came late did come"
    assert repr(lost) == "Loss(air=1, kernel=2, daemon=3, client=4, late=5)"
    lost.add(swarmtalk.Loss(10, 20, 30, 40, 50))
    assert lost == swarmtalk.Loss(11, 22, 33, 44, 55)
    for place in ("air", "kernel", "daemon", "client", "late"):
        one = swarmtalk.Loss(**{place: 1})
        assert one and one != swarmtalk.Loss() and not one == swarmtalk.Loss(), place
        assert one.total == (place != "late")
    assert not swarmtalk.Loss() and swarmtalk.Loss() != 0
    assert not swarmtalk.Loss() != swarmtalk.Loss()


@pytest.mark.parametrize("parts, known", [
    ((1, 2, 3), True), ((1, 2), False), ((1, 3), False), ((2, 3), False), ((), False)])
def test_a_pose_is_known_when_all_of_it_is(parts, known):
    body = b"".join(varint(each << 3 | 5) + struct.pack("<f", each) for each in parts)
    assert swarmtalk._pose(bytearray(body + field(4, 1500))) == (
        swarmtalk.Pose(1, 2, 3, 1.5) if known else None)


def test_what_send_refused_is_false_and_says_why():
    refused = swarmtalk.Refused("busy", "two have not left")
    assert not refused and (refused.code, refused.text) == ("busy", "two have not left")
    assert repr(refused) == "Refused('busy', 'two have not left')"


@pytest.mark.parametrize("look, told", [
    (bool, 0), (repr, 0), (lambda each: each.code, 0), (lambda each: each.text, 0), (id, 1)])
def test_a_refusal_that_was_looked_at_is_told_to_nobody(world, capsys, look, told):
    world.daemon.answers[ADVERTISE] = advertised()
    world.meet()
    publisher = world.client.advertise("a", queue=0)
    assert publisher.send("x")
    look(publisher.send("y"))
    world.client.process()
    assert len(capsys.readouterr().err.splitlines()) == told


def test_a_stderr_that_is_closed_ends_no_program(monkeypatch):
    monkeypatch.setattr(swarmtalk.sys, "stderr", None)
    swarmtalk._print_error("to nobody")
