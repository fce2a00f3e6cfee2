"""Radio manners, poses and neighbours, with real daemons on real wires."""
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
