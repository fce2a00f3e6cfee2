"""Radio manners, poses and neighbours, with real daemons on real wires."""
import json
import os
import pathlib
import re
import shlex
import socket
import subprocess
import sys

import pytest
from conftest import needs_root, next_line, one_line, program, run, wait_for
from wires import Wires, heard

pytestmark = needs_root

LINK = '[links.air]\ntype = "raw_l2"\ninterface = "a0"\n'


def node(number, *keys):
    return "\n".join([f"[node]\nid = {number}", *keys]) + "\n"


def neighbours(robot):
    done = robot.cli("neighbours", "--json")
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["neighbours"]


@pytest.fixture
def wires():
    with Wires() as made:
        made.wire("a")
        yield made


def a_virtual_range_drops_what_comes_from_beyond(wires, robots):
    def config(*limit):
        return node(1, "pose = [0.0, 0.0, 0.0]") + "\n".join([LINK, *limit])

    def all_publish(packets):
        for name, robot in others.items():
            robot.publish("c", name)
        wait_for(lambda: hearer.link("air")["counters"]["packets_received"] == packets,
                 what="the packets")

    hearer = next(robots).start(config("virtual_range_m = 1.0"))
    others = {"far": next(robots).start(node(3, "pose = [1.1, 0.0, 0.0]") + LINK),
              "near": next(robots).start(node(2, "pose = [0.9, 0.0, 0.0]") + LINK),
              "lost": next(robots).start(node(4) + LINK)}
    listener = hearer.subscribe("c")
    all_publish(3)
    hearer.configure(config("virtual_range_m = 1.0", 'virtual_range_unknown = "drop"'))
    assert hearer.cli("reload").stdout == "applied: links.air.virtual_range_unknown\n"
    all_publish(6)
    hearer.configure(config())
    assert hearer.cli("reload").returncode == 0
    all_publish(9)
    wait_for(lambda: hearer.counter("messages_received") == 6, what="the last message")
    listener.terminate()
    assert [message["text"] for message in heard(listener)] == ["near", "lost", "near", "far",
                                                                "near", "lost"]
    counters = hearer.link("air")["counters"]
    assert counters["packets_too_far"] == 2
    assert counters["packets_unknown_distance"] == 1


def a_pose_comes_as_text_and_garbage_is_counted_and_told(wires, robots):
    path = wires.file("pose.sock")
    robot = next(robots).start(node(1, f'pose_socket = "{path}"', "pose_max_age_ms = 60000")
                               + LINK)
    writer = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    for garbage in (b"", b"hello", b"1 2", b"1 2 nan", b"99 0 0", b"\xff" * 1000):
        writer.sendto(garbage, path)
    wait_for(lambda: robot.counter("poses_refused") == 6, what="the garbage to be read")
    assert robot.status()["pose"] is None
    writer.sendto(b"1.25 -0.5 3.0\n", path)
    pose = wait_for(lambda: robot.status()["pose"], what="the pose")
    assert (pose["x_m"], pose["y_m"], pose["theta_rad"]) == (1.25, -0.5, 3.0)
    writer.sendto(b"2 2 0 30.0", path)
    wait_for(lambda: robot.status()["pose"]["age_ms"] >= 30000, what="the older pose")
    writer.close()
    assert robot.counter("poses_received") == 2
    told = [line for line in robot.logged().splitlines() if "is not a pose" in line]
    assert 1 <= len(told) <= 2, "at most one line a second"
    robot.stop()
    assert not os.path.exists(path)


def who_listens_while_no_link_is_up_is_told(wires, robots):
    robot = next(robots).start(node(1) + LINK + "[reserved]\nharvest = true\n")
    listening = [("sub", "c"), ("log",), ("harvest",),
                 ("capture", wires.file("c.pcap"), "--replace")]
    for words in listening:
        told = robot.cli(*words, "-W", "0.3").stderr
        assert told == "" if words[0] != "harvest" else "nobody has answered" in told
    robot.execute("ip", "link", "set", "a0", "down")
    wait_for(lambda: not robot.link("air")["up"], what="the link to go down")
    for words in listening:
        one_line(robot.cli(*words, "-W", "0.3").stderr, "no link is up", "air: down:",
                 "ip link set a0 up", "nothing comes from other robots")
    offering = robot.listen("harvest", "--offer", "key=value")
    one_line(offering.stderr.readline(), "no link is up", "air: down:")
    robot.execute("ip", "link", "set", "a0", "up")
    wires.wait_for_wire(robot, "a")


def who_listens_is_told_once_when_the_last_link_goes_and_comes(wires, robots):
    robot = next(robots).start(node(1) + LINK)
    sub = robot.listen("sub", "c")
    for state, words in (("down", "no link is up"), ("up", "a link is up again: air")) * 2:
        robot.execute("ip", "link", "set", "a0", state)
        line = sub.stderr.readline()
        if "nothing was heard yet" in line:  # on a machine that took 3 s to come here
            line = sub.stderr.readline()
        assert words in line
    sub.terminate()
    assert sub.communicate(timeout=60)[1] == ""


def neighbours_are_listed_with_distance_pose_and_address(wires, robots):
    first = next(robots).start(node(1, "pose = [0.0, 0.0, 0.0]") + LINK)
    second = next(robots).start(node(2, "pose = [3.0, 4.0, 0.0]") + LINK)
    assert neighbours(first) == []
    second.publish("c", "x")
    other, = wait_for(lambda: neighbours(first), what="the frame")
    assert other["node_id"] == 2
    assert other["distance_m"] == pytest.approx(5.0, abs=0.002)
    assert other["pose"]["x_m"] == pytest.approx(3.0, abs=0.001)
    assert (other["frames"], other["frames_lost"], other["loss"]) == (1, 0, 0)
    assert (other["duplicate_id"], other["out_of_range"]) == (False, False)
    mac = json.loads(second.execute("ip", "-j", "link", "show", "a0").stdout)[0]["address"]
    assert other["address"] == mac
    line = first.cli("neighbours", "-v").stdout.splitlines()[1]
    assert "5.00 m" in line and mac in line


def two_robots_with_one_id_are_told_by_a_third(wires, robots):
    watcher = next(robots).start(node(1) + LINK)
    twins = [next(robots).start(node(7) + LINK) for _ in range(2)]
    for twin in [*twins, *twins]:
        twin.publish("c", "x")
    wait_for(lambda: watcher.counter("duplicate_neighbours") == 1, what="the duplicate")
    pair = neighbours(watcher)
    assert [each["node_id"] for each in pair] == [7, 7]
    assert all(each["duplicate_id"] for each in pair)
    assert len({each["address"] for each in pair}) == 2
    lines = [line for line in watcher.logged().splitlines() if "two robots have node id 7" in line]
    assert len(lines) == 1
    assert all(each["address"] in lines[0] for each in pair)
    assert "TWO ROBOTS HAVE THIS ID" in watcher.cli("neighbours").stdout


REPEAT = """
import socket, sys
s = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(0x88B5))
s.bind(("a0", 0x88B5))
print("ready", flush=True)
while True:
    frame, where = s.recvfrom(2048)
    if where[2] != socket.PACKET_OUTGOING and frame[6:12] != bytes.fromhex("020000000099"):
        s.send(frame[:6] + bytes.fromhex("020000000099") + frame[12:])
"""


def own_frames_from_a_repeater_with_another_address_are_echoes(wires, robots):
    robot = next(robots).start(node(1) + LINK)
    repeater = wires.keep(subprocess.Popen(
        ["ip", "netns", "exec", next(robots).namespace, sys.executable, "-c", REPEAT],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True))
    assert next_line(repeater) == "ready"
    robot.publish("c", "x", "--ttl", "3")
    wait_for(lambda: robot.link("air")["counters"]["own_echoes"] == 1, what="the echo")
    assert robot.counter("duplicate_node_ids") == 0
    assert neighbours(robot) == []


def silent_robots_see_each_other_by_their_beacons(wires, robots):
    beacon = LINK + "beacon_ms = 100\n"
    first = next(robots).start(node(1) + beacon)
    next(robots).start(node(2) + beacon)
    other, = wait_for(lambda: neighbours(first), what="a beacon")
    assert other["node_id"] == 2
    wait_for(lambda: first.link("air")["counters"]["beacons_sent"] >= 2, what="beacons")
    # A reload ends them.
    first.configure(node(1) + LINK)
    assert first.cli("reload").stdout == "applied: links.air.beacon_ms\n"
    sent = first.link("air")["counters"]["beacons_sent"]
    wait_for(lambda: neighbours(first)[0]["frames"] > other["frames"] + 3, what="the other's")
    assert first.link("air")["counters"]["beacons_sent"] == sent


def the_loss_of_a_last_message_is_found_by_a_beacon(wires, robots):
    hearer = next(robots).start(node(1) + LINK)
    sender = next(robots).start(node(2) + LINK + "beacon_ms = 200\n")
    listener = hearer.subscribe("c")
    sender.publish("c", "heard")
    wait_for(lambda: hearer.counter("messages_received") == 1, what="the first message")
    hearer.execute("ip", "link", "set", "a0", "down")
    sender.publish("c", "lost")
    hearer.execute("ip", "link", "set", "a0", "up")
    wait_for(lambda: hearer.counter("messages_lost_air") == 1, what="the loss")
    sender.publish("c", "heard")
    wait_for(lambda: hearer.counter("messages_received") == 2, what="the last message")
    listener.terminate()
    messages = heard(listener)
    assert [message["lost_before"]["air"] for message in messages] == [0, 1]
    assert hearer.counter("messages_lost_air") == 1


def air_time_is_estimated_where_the_rate_is_known(wires, robots):
    robot = next(robots).start(node(1) + LINK + "air_rate_mbps = 1.0\n")
    for _ in range(3):
        robot.publish("c", "x" * 64)
    counters = robot.link("air")["counters"]
    assert counters["frames_sent"] == 3
    # 3 frames of a header, a length, a packet of 17 + 64 bytes, and 36 bytes of the radio's.
    assert counters["airtime_us_sent"] == 3 * (552 + 8 * (18 + 2 + 17 + 64 + 36))
    metrics = robot.cli("metrics").stdout
    assert 'swarmtalk_link_airtime_us_sent_total{link="air"} 4944' in metrics


def log_lines_are_heard_around_where_debug_is_on(wires, robots):
    listener = next(robots).start(node(1) + LINK)
    robot = next(robots).start(node(2) + LINK)
    refused = robot.cli("log", "hello")
    assert refused.returncode == 1
    file, command = re.search(
        r"set debug = true under \[reserved\] in (\S+), then: (.*)", refused.stderr).groups()
    pathlib.Path(file).write_text(
        node(2) + LINK + "[reserved]\ndebug = true\nrate_hz = 1\nburst = 3\n")
    tool, *words = shlex.split(command)
    assert "applied: reserved.debug" in run(program(tool), *words).stdout
    lines, read = listener.listen("log", "--json"), listener.listen("log", "-C", 2)
    assert robot.cli("log", "lost the line").returncode == 0
    # An empty text, such as of a shell's empty variable, is a line and does not listen for ever.
    assert robot.cli("log", "").returncode == 0
    flood = robot.cli("pub", "debug", "x", "--repeat", "50", "--rate", "1000")
    assert flood.returncode == 1
    assert "rate_hz under [reserved]" in flood.stderr
    assert robot.counter("reserved_too_fast") == 1
    wait_for(lambda: listener.counter("messages_received") == robot.counter("messages_sent"),
             what="the lines")
    lines.terminate()
    told = heard(lines)
    first = read.communicate(timeout=60)[0].splitlines()[0]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT[\d:.]{15}Z  robot 2  lost the line", first)
    assert [(line["sender"], line["text"]) for line in told[:2]] == [(2, "lost the line"), (2, "")]


def values_are_harvested_over_two_hops(wires, robots):
    # A chain: nobody hears farther than 1.5 m, and the one in the middle has nothing to tell.
    def config(number):
        return (node(number, f"pose = [{number}.0, 0.0, 0.0]") + LINK
                + "virtual_range_m = 1.5\n[reserved]\nharvest = true\n")

    first, _, third = (next(robots).start(config(number)) for number in (1, 2, 3))
    third.listen("harvest", "--offer", "battery=3.9", "state=idle")
    first.listen("harvest", "--offer", "battery=4.1")
    done = first.cli("harvest", "bat", "--json", "-W", "3")
    assert done.returncode == 0, done.stderr
    values = sorted((json.loads(line) for line in done.stdout.splitlines()),
                    key=lambda value: value["node_id"])
    assert [(value["node_id"], value["text"], value["hops"], value["local"])
            for value in values] == [(1, "4.1", 0, True), (3, "3.9", 1, False)]
    assert {value["key"] for value in values} == {"battery"}
    alone = first.cli("harvest", "--ttl", "0", "-W", "1")
    assert alone.stdout.splitlines() == ['robot 1  "battery" = "4.1"  from this robot']


def a_program_in_c_looks_around(wires, robots):
    reserved = LINK + "[reserved]\nharvest = true\n"
    robot = next(robots).start(node(1) + reserved)
    other = next(robots).start(node(2, "pose = [3.0, 4.0, 0.0]") + reserved)
    other.listen("harvest", "--offer", "battery=3.9")
    done = robot.execute(program("c_robot"), 0, 0, 1,
                         env={**os.environ, "SWARMTALK_SOCKET": robot.socket})
    assert done.stdout.splitlines() == [
        "pose unknown", "pose 0.00 0.00", "value of 2: battery = 3.9, remote",
        "neighbour 2 by air at an address, 5.00 m, pose 3.00 4.00, once, frames some",
        "1 neighbours"], done.stderr
    assert done.returncode == 0


def packets_that_wait_for_the_pacer_leave_in_one_frame(wires, robots):
    hearer = next(robots).start(node(1) + LINK)
    robot = next(robots).start(node(2) + LINK + "rate_hz = 0.5\njitter_us = 1000\n")
    channels = [str(number) for number in range(6)]
    listener = hearer.subscribe(*channels)
    robot.publish("0", "leaves at once")
    together = 'for channel in 0 1 2 3 4 5; do "$0" --socket "$1" pub $channel waits & done; wait'
    done = robot.execute("sh", "-c", together, program("swarmtalk-cli"), robot.socket)
    assert (done.returncode, done.stderr) == (0, "")
    wait_for(lambda: hearer.counter("messages_received") == 7, what="the messages")
    listener.terminate()
    assert len(heard(listener)) == 7
    counters = robot.link("air")["counters"]
    assert counters["packets_sent"] == 7
    assert counters["frames_sent"] < 7
    assert hearer.link("air")["counters"]["frames_received"] == counters["frames_sent"]


def on_one_wire(wires, steps):
    """Does each step with daemons of its own, in the same robots."""
    robots = [wires.robot("a") for _ in range(4)]
    for step in steps:
        step(wires, iter(robots))
        wires.end_all()


def test_who_is_around_and_where(wires):
    on_one_wire(wires, (a_virtual_range_drops_what_comes_from_beyond,
                        neighbours_are_listed_with_distance_pose_and_address,
                        a_pose_comes_as_text_and_garbage_is_counted_and_told,
                        two_robots_with_one_id_are_told_by_a_third,
                        own_frames_from_a_repeater_with_another_address_are_echoes,
                        values_are_harvested_over_two_hops, a_program_in_c_looks_around))


def test_what_is_on_the_air_and_what_is_lost(wires):
    on_one_wire(wires, (who_listens_while_no_link_is_up_is_told,
                        who_listens_is_told_once_when_the_last_link_goes_and_comes,
                        silent_robots_see_each_other_by_their_beacons,
                        the_loss_of_a_last_message_is_found_by_a_beacon,
                        air_time_is_estimated_where_the_rate_is_known,
                        log_lines_are_heard_around_where_debug_is_on,
                        packets_that_wait_for_the_pacer_leave_in_one_frame))
