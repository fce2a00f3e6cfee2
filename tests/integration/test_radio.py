"""Radio manners, poses and neighbours, with real daemons on real wires."""
import os
import socket

import pytest
from conftest import needs_root, wait_for
from wires import Wires, heard

pytestmark = needs_root

LINK = '[links.air]\ntype = "raw_l2"\ninterface = "a0"\n'


def node(number, *keys):
    return "\n".join([f"[node]\nid = {number}", *keys]) + "\n"


@pytest.fixture
def wires():
    with Wires() as made:
        made.wire("a")
        yield made


def test_a_virtual_range_drops_what_comes_from_beyond(wires):
    def config(*limit):
        return node(1, "pose = [0.0, 0.0, 0.0]") + "\n".join([LINK, *limit])

    def all_publish(packets):
        for name, robot in others.items():
            robot.publish("c", name)
        wait_for(lambda: hearer.link("air")["counters"]["packets_received"] == packets,
                 what="the packets")

    hearer = wires.robot("a").start(config("virtual_range_m = 1.0"))
    others = {"far": wires.robot("a").start(node(3, "pose = [1.1, 0.0, 0.0]") + LINK),
              "near": wires.robot("a").start(node(2, "pose = [0.9, 0.0, 0.0]") + LINK),
              "lost": wires.robot("a").start(node(4) + LINK)}
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


def test_a_pose_comes_as_text_and_garbage_is_counted_and_told(wires):
    path = wires.file("pose.sock")
    robot = wires.robot("a").start(node(1, f'pose_socket = "{path}"', "pose_max_age_ms = 60000")
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
    told = [line for line in robot.logged().splitlines() if "is no pose" in line]
    assert 1 <= len(told) <= 2, "at most one line a second"
    robot.stop()
    assert not os.path.exists(path)
