"""Beacons in another's name that tell of messages nobody has sent."""
from conftest import wait_for
from stranger import Air, counter

TITLE = "3 forged beacons, each of 9,000 messages more, after 20 messages"
REFERENCE = "27,000 false losses told"


def measure():
    with Air() as air:
        sender, hearer = air.daemon(1), air.daemon(2)
        listener = hearer.subscribe("5")
        sender.publish("5", "real", "--repeat", 20, "--rate", 50)
        wait_for(lambda: counter(hearer, "node_messages_received") == 20, what="the messages")
        before = counter(hearer, "frames_received")
        air.attack("false_beacons", "--channel", 5, "--node", 1, "--epoch",
                   sender.status()["epoch"], "--seconds", 1, "--rate", 3)
        wait_for(lambda: counter(hearer, "frames_received") >= before + 3, what="the beacons")
        listener.terminate()
        return f"{hearer.counter('messages_lost_air')} false losses told"
