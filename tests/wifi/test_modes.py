"""Unmodified daemons in the modes that robots use, on one guest: who hears whom, what is on the
air."""
import re

import guest
import pytest

pytestmark = pytest.mark.long
MESSAGES = 50


@pytest.fixture(scope="module")
def machine():
    guest.needs_guest()
    with guest.Guest(radios=3) as booted:
        yield booted


@pytest.fixture
def swarm(machine, request):
    """Three robots with their daemons, in a network of the mode that the test names."""
    with machine.network(request.param) as network:
        for robot in machine.robots:
            machine.daemon(robot)
        yield network
        machine.end_daemons()


def rates(frames):
    """Mbit/s of each frame, as its radiotap header has them."""
    return {re.search(r"(\d+\.\d+) Mb/s", frame)[1] for frame in frames}


@pytest.mark.parametrize("swarm", ["ibss", "mesh", "ap"], indirect=True)
def test_every_message_arrives(machine, swarm):
    accounts = machine.exchange("r1", ["r2", "r3"], MESSAGES)
    for robot, account in accounts.items():
        assert account.unaccounted == 0 and account.duplicates == 0, (robot, account)
        assert account.heard >= MESSAGES, (robot, account)


@pytest.mark.parametrize("swarm", ["ap-isolated"], indirect=True)
def test_an_isolating_access_point_takes_every_frame_and_repeats_none(machine, swarm):
    machine.check("", "ip link set hwsim0 up")
    address = machine.check("r1", "cat", "/sys/class/net/wlan0/address").strip()
    with guest.Capture(machine, "", "hwsim0") as air:
        accounts = machine.exchange("r1", ["r2", "r3"], MESSAGES, expected=False)
        frames_sent = machine.stats("r1")["links"][0]["counters"]["frames_sent"]
    for robot, account in accounts.items():
        assert account.heard == 0 and account.unheard_of == account.sent, (robot, account)
        assert machine.stats(robot)["links"][0]["counters"]["frames_received"] == 0
    to_broadcast = "type data and wlan addr3 ff:ff:ff:ff:ff:ff"
    up = air.frames(f"dir tods and {to_broadcast} and wlan addr2 {address}")
    assert MESSAGES <= len(up) <= frames_sent + 2, frames_sent
    assert air.frames("dir fromds and type data and wlan addr1 ff:ff:ff:ff:ff:ff "
                      f"and wlan addr3 {address}") == []


@pytest.mark.parametrize("swarm", ["ibss"], indirect=True)
def test_a_monitor_sees_each_frame_at_the_rate_that_was_asked_for(machine, swarm):
    machine.check("ap2", "set -e; ip link set wlan0 down; iw dev wlan0 set type monitor; "
                         "ip link set wlan0 up; iw dev wlan0 set channel 1")
    before = machine.stats("r1")["links"][0]["counters"]["frames_sent"]
    with guest.Capture(machine, "ap2", "wlan0") as air:
        accounts = machine.exchange("r1", ["r2"], MESSAGES)
    after = machine.stats("r1")["links"][0]["counters"]["frames_sent"]
    address = machine.check("r1", "cat", "/sys/class/net/wlan0/address").strip()
    seen = air.frames(f"type data and wlan addr2 {address}")
    assert accounts["r2"].heard >= MESSAGES
    assert MESSAGES <= len(seen) <= after - before
    assert rates(seen) == {"6.0"}
    machine.check("ap2", "ip link set wlan0 down; iw dev wlan0 set type managed")
