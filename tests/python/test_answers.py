"""The daemon's answers as the Python client hands them on, against ipc/ipc.proto: each field gets
another value, and must come back under its own name, in seconds where the protocol has
milliseconds."""
import pathlib
import re
import struct

import pytest

import swarmtalk
from local_frames import field, varint

pytestmark = pytest.mark.logic

PROTOCOL = (pathlib.Path(__file__).resolve().parents[2] / "ipc/ipc.proto").read_text()
NAMES = {"clients_served": "programs", "distance_m": "distance", "bearing_rad": "bearing",
         "age_ms": "age", "uptime_ms": "uptime"}
# For swarmtalk-cli doctor and people who look.
NOT_HANDED_ON = {
    "Neighbour": {"signal_dbm"}, "ChannelStatus": set(), "ClientStatus": set(),
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
