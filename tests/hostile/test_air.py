"""What strangers on the air can do to robots on a link without a key, and what they cannot."""
import json
import os

import pytest
from conftest import needs_root, wait_for
from stranger import counter
from wires import heard, written

pytestmark = needs_root
SECONDS = os.environ["SWARMTALK_HOSTILE_SECONDS"]
CHANNEL = 5


def hear_on_though_an_origin_is_not_text(air, sender, hearer):
    listener = hearer.subscribe(str(CHANNEL), "-C", "1", "-W", "60")
    frames = int(air.attack("bad_origin", "--channel", CHANNEL, "--seconds", SECONDS))
    sender.publish(str(CHANNEL), "still here")
    assert [message["text"] for message in heard(listener)] == ["still here"]
    assert counter(hearer, "node_bad_origins") == frames


def hear_messages_of_several_packets_among_lone_fragments(air, sender, hearer, ttl, new):
    messages = 50
    enough = int(0.98 * messages)
    listener = hearer.subscribe(str(CHANNEL), "-C", enough, "-W", "60")
    attack = air.begin("last_fragments", "--channel", CHANNEL, "--ttl", ttl, "--rate", 8,
                       "--seconds", float(SECONDS) + 1, *new)
    before = counter(hearer, "packets_received")
    wait_for(lambda: counter(hearer, "packets_received") > before + 256, what="a full pool")
    sender.publish(str(CHANNEL), "x" * 4000, "--repeat", messages, "--rate",
                   messages / float(SECONDS), "--ttl", ttl)
    attack.communicate(timeout=90)
    assert len([each for each in heard(listener) if each["size_bytes"] == 4000]) == enough


@pytest.mark.field
@pytest.mark.parametrize("ttl", [0, 3])
@pytest.mark.parametrize("new", [[], ["--new"]], ids=["one_robot", "new_robots"])
def test_lone_last_fragments_deny_no_message_of_several_packets(air, ttl, new):
    hear_messages_of_several_packets_among_lone_fragments(air, air.daemon(1), air.daemon(2), ttl,
                                                          new)


def take_forged_beacons_for_few_losses(air, sender, hearer):
    listener = hearer.subscribe(str(CHANNEL), "-C", "21", "-W", "60")
    had = counter(hearer, "node_messages_received")
    sender.publish(str(CHANNEL), "real", "--repeat", "20", "--rate", "50")
    wait_for(lambda: counter(hearer, "node_messages_received") == had + 20, what="the messages")
    air.attack("false_beacons", "--channel", CHANNEL, "--node", 1, "--epoch",
               sender.status()["epoch"], "--seconds", SECONDS)
    wait_for(lambda: hearer.counter("beacons_not_believed") > 10, what="the beacons")
    sender.publish(str(CHANNEL), "real")
    lost = sum(message["lost_before"]["air"] for message in heard(listener))
    assert lost == 0, "each told of 9000 messages that nobody has sent"
    assert hearer.counter("messages_lost_air") == 0


@pytest.mark.field
@pytest.mark.parametrize("hops", [0, 3], ids=["direct", "sent_on"])
def test_made_up_numbers_of_messages_tell_few_false_losses(air, hops):
    sender, hearer = air.daemon(1), air.daemon(2)
    count = int(50 * (float(SECONDS) + 2))
    listener = hearer.listen("sub", str(CHANNEL), "--json", "--keep-last", "1000", file=True)
    publisher = sender.begin("pub", str(CHANNEL), "real", "--repeat", count, "--rate", 50)
    wait_for(lambda: counter(hearer, "node_messages_received") >= 20, what="some messages")
    air.attack("false_numbers", "--channel", CHANNEL, "--node", 1, "--epoch",
               sender.status()["epoch"], "--seconds", SECONDS, "--hops", hops)
    out, error = publisher.communicate(timeout=90)
    assert publisher.returncode == 0, out + error

    def real():
        return [each for each in written(listener) if each["text"] == "real"]

    wait_for(lambda: len(real()) >= count, what="the honest messages")
    made_up = len(written(listener)) - count
    assert made_up > 100 and hearer.counter("numbers_not_believed") > 0.9 * made_up
    # As many as can have been missed if the machine let the sender wait for a second or two.
    assert hearer.counter("messages_lost_air") < 500, f"each of {made_up} told of 9000"
    neighbour, = json.loads(hearer.cli("neighbours", "--json").stdout)["neighbours"]
    assert neighbour["frames_lost"] < 500


def hear_without_forwarding(air, sender):
    silent = air.daemon(3, "forward = false\n")
    listener = silent.subscribe(str(CHANNEL), "-C", "1", "-W", "60")
    sender.publish(str(CHANNEL), "once", "--ttl", "5")
    assert [message["text"] for message in heard(listener)] == ["once"]
    assert counter(silent, "frames_sent") == 0


def test_strangers_disturb_nobody_who_hears(air):
    sender, hearer = air.daemon(1), air.daemon(2)
    take_forged_beacons_for_few_losses(air, sender, hearer)
    hear_on_though_an_origin_is_not_text(air, sender, hearer)
    hear_messages_of_several_packets_among_lone_fragments(air, sender, hearer, 3, ["--new"])
    hear_without_forwarding(air, sender)
