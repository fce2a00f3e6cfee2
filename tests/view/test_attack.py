"""The port of swarmtalk-view under attack (tests/hostile/attacks/view_storm.py): who looks goes on
looking, who comes finds a place, and nothing stays when the attackers have gone."""
import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
import time

import pytest
from conftest import ROOT, one_line, serving, wait_for
from viewers import message_where, page
from websocket import get

ATTACK = ROOT / "tests/hostile/attacks/view_storm.py"
SEED = os.environ.get("SWARMTALK_SEED", "1")
SECONDS, MESSAGES, LEAST_HEARD = 4, 80, 0.98
MOST_PLACES = 128


@pytest.fixture
def begin():
    running = []

    def start(view, *words):
        running.append(subprocess.Popen(
            [sys.executable, "-B", str(ATTACK), str(view.port), *map(str, words)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True))
        return running[-1]

    yield start
    for process in running:
        process.kill()
        process.communicate()


def resident_kib(view):
    with open(f"/proc/{view.process.pid}/status", encoding="ascii") as file:
        return int(next(line for line in file if line.startswith("VmRSS")).split()[1])


def find_a_place_among_requests_that_never_end(view):
    held = []
    try:
        for number in range(2 * MOST_PLACES):
            held.append(socket.create_connection(("127.0.0.1", view.port), timeout=10))
            if number % 2:
                held[-1].sendall(b"GET / HTTP/1.1\r\nHost: loc")
        with page(view) as viewer:
            message_where(viewer, lambda m: m["t"] == "state")
            for _ in range(2 * MOST_PLACES):  # and keeps it
                held.append(socket.create_connection(("127.0.0.1", view.port), timeout=10))
            message_where(viewer, lambda m: m["t"] == "state")
    finally:
        for each in held:
            each.close()


def be_told_that_there_is_no_place(lab):
    sentence = f"{MOST_PLACES} viewers look already, the most there may be: close some pages"
    with serving(lab) as view:
        before = view.descriptors()
        with contextlib.ExitStack() as stack:
            viewers = [stack.enter_context(page(view)) for _ in range(MOST_PLACES)]
            for viewer in viewers:
                message_where(viewer, lambda m: m["t"] == "hello")
            for _ in range(20):  # more than may wait
                status, head, body = get(view.port)
                assert status == 503 and body.decode() == sentence + "\n"
                with page(view) as one_more:
                    assert close_of(one_more) == (1013, sentence)
            message_where(viewers[0], lambda m: m["t"] == "state")
            viewers.pop().connection.close()
            wait_for(lambda: get(view.port)[0] == 200, what="a place")
            with page(view) as one_more:
                message_where(one_more, lambda m: m["t"] == "state")
        wait_for(lambda: view.descriptors() <= before, what="closed connections")
        errors = view.end()[1]
        sentence = "128 viewers look, the most there may be; 1 was turned away"
        assert sentence in errors.splitlines()[0]


def go_on_under_attack(lab, view, begin):
    before, resident = view.descriptors(), resident_kib(view)
    with page(view) as viewer:
        viewer.send(json.dumps({"op": "watch", "channel": "chat"}))
        message_where(viewer, lambda m: m["t"] == "info" and
                      any(c["name"] == "chat" for c in m["channels"]))
        attacks = [begin(view, SECONDS, int(SEED) + number) for number in range(2)]
        talker = lab.start_cli(2, "pub", "chat", "honest", "--repeat", str(MESSAGES), "--rate",
                               str(MESSAGES / SECONDS))
        heard = 0
        while heard < LEAST_HEARD * MESSAGES:
            told = message_where(viewer, lambda m: m["t"] == "msg", 30.0, "an honest message")
            heard += told["hex"] == b"honest".hex()
        made = [json.loads(attack.stdout.readline()) for attack in attacks]
        with page(view) as other:
            message_where(other, lambda m: m["t"] == "state")
        grown = resident_kib(view) - resident
        talker.wait(timeout=30)
        for attack in attacks:
            attack.communicate("")
        gone = time.monotonic()
        wait_for(lambda: view.descriptors() <= before + 1, what="the attackers' descriptors")
        print(f"{heard} or more of {MESSAGES} heard, {made}, {grown} KiB more, descriptors back "
              f"after {time.monotonic() - gone:.1f} s")
    assert all(sum(each.values()) > 10 for each in made)
    assert any(each["refused"] for each in made)  # foreign pages and names, wrong tokens
    assert grown < 64 * 1024
    assert view.process.poll() is None


def close_of(viewer):
    """Code and reason with which a viewer is closed."""
    kind, body = viewer.frame()
    while kind != 8:
        kind, body = viewer.frame()
    return struct.unpack(">H", body[:2])[0], body[2:].decode()


TOO_LONG = 1009, "a message may have 65536 bytes at most"  # RFC 6455, 7.4.1: too big to process


def be_told_of_a_message_that_is_too_long(lab):
    for size in (65_537, 70_000, 5_000_000):
        with serving(lab) as view:
            with page(view) as viewer:
                viewer.send(" " * 65_536)  # the longest, and no request
                message_where(viewer, lambda m: m["t"] == "notice")
                viewer.send("x" * size)
                assert close_of(viewer) == TOO_LONG, size
            _, errors = view.end()
        one_line(errors, "swarmtalk-view:", "more than 65536 bytes", "1 so far")
    with serving(lab) as view:
        for size in (65_537, 2**31, 2**62):  # what is announced is not waited for
            with page(view) as viewer:
                viewer.connection.sendall(struct.pack(">BBQ4s", 0x81, 0xFF, size, b"mask")
                                          + b"x" * 9)
                assert close_of(viewer) == TOO_LONG, size


def test_who_looks_goes_on_looking_and_nothing_stays_of_attacks(make_lab, make_view, begin):
    lab = make_lab(2)
    be_told_of_a_message_that_is_too_long(lab)
    be_told_that_there_is_no_place(lab)
    view = make_view(lab.socket(1))
    find_a_place_among_requests_that_never_end(view)
    view.end()
    go_on_under_attack(lab, make_view(lab.socket(1)), begin)
