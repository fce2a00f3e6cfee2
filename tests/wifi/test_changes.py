"""What happens to a Wi-Fi while robots talk: keys change, the access point restarts, a robot roams,
a station sleeps, an interface goes away. The daemons are left alone: they have to come back by
themselves, and every message is heard or counted as lost."""
import guest
import pytest

pytestmark = pytest.mark.long
MESSAGES = 40
RATE_HZ = 10


@pytest.fixture(scope="module")
def machine():
    guest.needs_guest()
    with guest.Guest(radios=2, modules=("bridge", "veth")) as booted:
        yield booted


@pytest.fixture
def daemons(machine):
    """Two robots' daemons, which the whole test uses."""
    yield lambda: [machine.daemon(robot) for robot in machine.robots]
    machine.end_daemons()


def assert_all_heard(machine, channel):
    """Both ways: what is sent now arrives, all of it."""
    for sender, listener in (("r1", "r2"), ("r2", "r1")):
        account = machine.exchange(sender, [listener], MESSAGES, RATE_HZ, channel=channel)[listener]
        assert account.heard >= MESSAGES and account.unaccounted == 0, (sender, account)


def link(machine, robot):
    return machine.stats(robot)["links"][0]


def wait_for_link(machine, robot, is_up):
    for _ in range(60):
        if link(machine, robot)["up"] == is_up:
            return link(machine, robot)
        machine.run("", "sleep 0.5")
    raise AssertionError(f"{robot}: {link(machine, robot)}")


def test_group_keys_change_while_robots_talk(machine, daemons):
    with machine.network("ap", hostapd={"wpa_group_rekey": 2}) as network:
        daemons()
        account = machine.exchange("r1", ["r2"], 5 * MESSAGES, 2 * RATE_HZ)["r2"]
        changes = network.programs["ap1"].stdout.count("group key handshake completed")
    assert changes >= 6, network.programs  # two robots, three changes and more
    # A frame under the new key may come before a station has it: lost on the air, and counted.
    assert account.unaccounted == 0 and account.duplicates == 0, account
    assert account.heard >= 5 * MESSAGES * 0.95, account


def test_an_access_point_restarts(machine, daemons):
    with machine.network("ap") as network:
        daemons()
        assert_all_heard(machine, "before")
        network.stop_access_point()
        down = wait_for_link(machine, "r1", False)
        assert "has no carrier" in down["state"], down
        done = machine.cli("r1", "pub", "lost", "x")
        assert done.returncode == 1 and "carrier" in done.stderr, done.stderr
        network.start_access_point()
        network.wait_until_joined()
        for robot in machine.robots:
            wait_for_link(machine, robot, True)
        assert_all_heard(machine, "after")
        assert link(machine, "r1")["counters"]["link_down_events"] == 1


def test_an_interface_goes_down_and_comes_back_in_another_mode(machine, daemons):
    with machine.network("ibss"):
        daemons()
        assert_all_heard(machine, "cell")
        machine.check("r2", "ip link set wlan0 down")
        assert "switched off" in wait_for_link(machine, "r2", False)["state"]
        machine.check("r1", "ip link set wlan0 down")
    with machine.network("mesh"):
        for robot in machine.robots:
            wait_for_link(machine, robot, True)
        assert_all_heard(machine, "mesh")


def test_a_robot_roams_to_another_access_point(machine, daemons):
    with machine.network("ap", wired="ap2") as network:
        daemons()
        assert_all_heard(machine, "one")
        network.roam("r1", "ap2")
        assert network.address("ap2") in machine.check("r1", "iw dev wlan0 link")
        wait_for_link(machine, "r1", True)
        assert_all_heard(machine, "two")


def test_group_frames_wait_for_a_sleeping_station(machine, daemons):
    """One sleeping station delays them for all; not one of them is lost by that."""
    machine.check("", "ip link set hwsim0 up")
    with machine.network("ap", hostapd={"dtim_period": 3}) as network:
        machine.daemon("r1")
        machine.daemon("r2", link="beacon_ms = 0")  # who sends is awake
        group = ("type data and dir fromds and wlan addr1 ff:ff:ff:ff:ff:ff "
                 f"and wlan addr2 {network.address('ap1')}")
        held = {}
        for is_asleep in (False, True):
            network.sleep("r2", is_asleep)
            with guest.Capture(machine, "", "hwsim0") as air:
                account = machine.exchange("r1", ["r2"], MESSAGES, 2 * RATE_HZ,
                                           channel=f"asleep {is_asleep}")["r2"]
            assert account.heard >= MESSAGES and account.unaccounted == 0, account
            frames = air.frames(group)
            assert len(frames) >= MESSAGES / 2  # in a slow guest some share one
            more = len(air.frames(f"{group} and wlan[1] & 0x20 != 0"))  # more data
            held[is_asleep] = more / len(frames)
        network.sleep("r2", False)
        machine.end_daemons()
    # Held until the beacon that calls them: several at once, all but the last of which say "more".
    assert held[False] == 0 and held[True] > 1 / 4, held


def test_a_channel_that_the_regulatory_domain_forbids(machine, daemons):
    """No country is set, and the world's common rules have no channel 14."""
    done = machine.run("r1", "set -e; ip link set wlan0 down; iw dev wlan0 set type ibss; "
                             "ip link set wlan0 up; iw dev wlan0 ibss join swarm 2484")
    assert done.returncode != 0 and "2484" not in machine.check("r1", "iw dev wlan0 info")
    daemons()
    assert "has no carrier" in wait_for_link(machine, "r1", False)["state"]
    with machine.network("ibss"):
        wait_for_link(machine, "r1", True)
        assert_all_heard(machine, "allowed")
