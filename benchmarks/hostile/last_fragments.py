"""Lone last fragments of one byte, each from a robot of its own."""
from conftest import wait_for
from stranger import Air, counter
from wires import heard

TITLE = "4 frames/s of 64 lone last fragments of new robots, 50 messages of 4,000 bytes"
REFERENCE = "15 of 50 heard; with TTL 0, 5 of 50"
MESSAGES = 50


def once(ttl):
    with Air() as air:
        sender, hearer = air.daemon(1), air.daemon(2)
        listener = hearer.subscribe("5", "-W", "18")
        attack = air.begin("last_fragments", "--channel", 5, "--ttl", ttl, "--rate", 4,
                           "--seconds", 12, "--new")
        wait_for(lambda: counter(hearer, "packets_received") > 256, what="a full pool")
        sender.publish("5", "x" * 4000, "--repeat", MESSAGES, "--rate", 5, "--ttl", ttl)
        attack.communicate(timeout=60)
        return sum(message["size_bytes"] == 4000 for message in heard(listener, timeout=60))


def measure():
    return f"{once(3)} of {MESSAGES} heard; with TTL 0, {once(0)} of {MESSAGES}"
