"""Redundancy with real daemons on a wire that loses a fifth of all frames."""
import json
import re
import signal

import pytest
from conftest import needs_root, program, run, wait_for
from wires import Wires, written

pytestmark = needs_root

LINK = '[links.air]\ntype = "raw_l2"\ninterface = "a0"\nair_rate_mbps = 6.0\n'
MESSAGES = 100


@pytest.fixture
def wires():
    with Wires() as made:
        for name in "ab":
            made.wire(name)
        yield made


def config(number, keys=""):
    return f"[node]\nid = {number}\n{LINK}{keys}"


def publish(sender, hearers, *words, rate=40):
    """Publishes; returns what each hearer heard, and the rise of the sender's counters."""
    before = sender.link("air")["counters"]
    listeners = [hearer.listen("sub", "--json", "c", file=True) for hearer in hearers]
    done = sender.cli("pub", "c", "--repeat", MESSAGES, "--rate", rate, *words)
    assert (done.returncode, done.stderr) == (0, "")
    heard_then = -1
    while heard_then != (now := [hearer.counter("messages_received") for hearer in hearers]):
        heard_then = now  # until nothing more comes
        wait_a_moment(sender)
    for listener in listeners:
        listener.send_signal(signal.SIGTERM)
        listener.wait(timeout=60)
    after = sender.link("air")["counters"]
    return ([written(listener) for listener in listeners],
            {name: value - before[name] for name, value in after.items()})


def wait_a_moment(robot):
    """Longer than a late copy waits for a frame."""
    assert robot.cli("sub", "nothing", "-W", "0.4").stdout == ""


def expect(messages, least, most, payload=None):
    """That many of the messages came, each once and whole."""
    numbers = [message["message_number"] for message in messages]
    assert len(numbers) == len(set(numbers)), "a message was delivered twice"
    assert least <= len(numbers) <= most
    if payload is not None:
        assert all(bytes.fromhex(message["hex"]) == payload for message in messages)


def four_packets_arrive_though_a_fifth_of_all_frames_is_lost(wires, sender, hearers):
    payload = bytes(i * 7 % 251 for i in range(4 * 1383))
    path = wires.file("message")
    with open(path, "wb") as file:
        file.write(payload)
    plain, counters = publish(sender, hearers, "--file", path)
    assert counters["packets_sent"] == 4 * MESSAGES
    for messages in plain:
        expect(messages, 20, 62)  # 41
    redundant, counters = publish(sender, hearers, "--file", path, "--redundancy", "3")
    assert counters["packets_sent"] == 7 * MESSAGES
    assert counters["repairs_sent"] == 3 * MESSAGES
    for messages, hearer in zip(redundant, hearers):
        expect(messages, 88, 100, payload)  # 97
        counters = hearer.link("air")["counters"]
        assert counters["packets_recovered"] > 40
        assert counters["node_bad_packets"] == 0
    # Side by side with copies.
    both, counters = publish(sender, hearers, "--file", path, "--redundancy", "3", "--copies", "2",
                             rate=20)
    assert counters["packets_sent"] == 11 * MESSAGES
    for messages in both:
        expect(messages, 96, 100, payload)


def one_packet_arrives_for_little_air_though_a_fifth_of_all_frames_is_lost(sender, hearers):
    text = "x" * 24
    plain, plain_counters = publish(sender, hearers, text, rate=100)
    assert plain_counters["frames_sent"] == MESSAGES
    for messages in plain:
        expect(messages, 64, 94)  # 80
    redundant, counters = publish(sender, hearers, text, "--redundancy", "1", rate=100)
    for messages in redundant:
        expect(messages, 88, 100)  # 96
    assert counters["repairs_sent"] == MESSAGES
    assert counters["frames_sent"] == MESSAGES + 1, "the last copy alone leaves by itself"
    assert counters["airtime_us_sent"] <= 1.3 * plain_counters["airtime_us_sent"]


def redundancy_follows_the_loss_that_is_measured(wires):
    sender, _ = (wires.robot("b").start(config(number, "beacon_ms = 20\n").replace("a0", "b0"))
                 for number in (1, 2))
    path = wires.file("message")
    with open(path, "wb") as file:
        file.write(bytes(4 * 1383))
    wait_for(lambda: neighbour_frames(sender) > 40, what="the neighbour")
    words = ("c", "--file", path, "--repeat", "10", "--rate", "100", "--redundancy", "auto")
    assert sender.cli("pub", *words).returncode == 0
    assert sender.link("air")["counters"]["repairs_sent"] == 0
    wires.lose("b", 0.3)
    wait_for(lambda: neighbour(sender)["loss"] > 0.12, what="the loss to be measured")
    # It is looked up once a second.
    wait_for(lambda: sender.cli("pub", *words).returncode == 0
             and sender.link("air")["counters"]["repairs_sent"] >= 10, what="repair packets")


def neighbour(robot):
    return json.loads(robot.cli("neighbours", "--json").stdout)["neighbours"][0]


def neighbour_frames(robot):
    heard_of = json.loads(robot.cli("neighbours", "--json").stdout)["neighbours"]
    return heard_of[0]["frames"] if heard_of else 0


def where_there_is_no_redundancy_it_is_told(sender):
    sender.stop()
    sender.start(config(1, 'profile = "footbot"\nnode_id = 1\n'))
    done = sender.cli("pub", "3", "x", "--redundancy", "2")
    assert done.returncode == 0
    assert re.search(r"without repair packets.*profile \"wifi\".*--copies", done.stderr)


@pytest.mark.field
def test_messages_arrive_though_a_fifth_of_all_frames_is_lost(wires):
    sender, *hearers = (wires.robot("a").start(config(number)) for number in (1, 2, 3))
    wires.lose("a", 0.2)
    four_packets_arrive_though_a_fifth_of_all_frames_is_lost(wires, sender, hearers)
    one_packet_arrives_for_little_air_though_a_fifth_of_all_frames_is_lost(sender, hearers)
    where_there_is_no_redundancy_it_is_told(sender)
    redundancy_follows_the_loss_that_is_measured(wires)


@pytest.mark.logic
def test_more_redundancy_than_there_is_is_refused():
    done = run(program("swarmtalk-cli"), "pub", "3", "x", "--redundancy", "13")
    assert done.returncode == 2
    assert "auto, or 1 to 12, not 13" in done.stderr
