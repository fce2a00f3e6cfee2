"""Our own air between the guest's radios: what it loses is what the daemons say was lost."""
import guest
import pytest

pytestmark = pytest.mark.long
MESSAGES = 120
SHARE = 0.3


@pytest.fixture(scope="module")
def machine():
    guest.needs_guest()
    with guest.Guest(radios=3, access_points=1) as booted:
        yield booted


@pytest.fixture
def daemons(machine):
    """Starts a daemon on each of the robots that are named."""
    def start(robots, link=""):
        for robot in robots:
            machine.daemon(robot, link)
    yield start
    machine.end_daemons()


def lost(medium, sender, receiver):
    pair = medium.counters()["pairs"][sender, receiver]
    return pair["data_lost_weak"] + pair["data_lost_set"]


def test_what_the_air_loses_is_what_the_daemon_counts(machine, daemons):
    with machine.medium() as medium, machine.network("ibss"):
        daemons(["r1", "r2"])
        medium.lose("r1", "r2", SHARE)
        before = lost(medium, "r1", "r2")
        frames = machine.stats("r1")["links"][0]["counters"]["frames_sent"]
        account = machine.exchange("r1", ["r2"], MESSAGES)["r2"]
        after = lost(medium, "r1", "r2")
        sent = machine.stats("r1")["links"][0]["counters"]["frames_sent"] - frames
        seen = medium.counters()["pairs"]["r1", "r2"]
    assert account.unaccounted == 0 and account.duplicates == 0, account
    # Beacons are lost as well, so the air's figure is at least the daemon's; all of it was set.
    assert 0.5 * SHARE < account.lost_air / account.sent < 1.6 * SHARE, account
    assert account.lost_air <= after - before <= account.lost_air + account.unheard_of + \
        sent - account.sent, account
    assert seen["data_lost_weak"] == 0 and seen["data_lost_set"] == after, seen


def test_an_access_points_clients_lose_on_the_second_way_only(machine, daemons):
    with machine.medium() as medium, machine.network("ap"):
        daemons(["r1", "r2"])
        medium.lose("r1", "ap1", SHARE)  # acknowledged, and so sent again
        account = machine.exchange("r1", ["r2"], MESSAGES)["r2"]
        assert account.heard >= MESSAGES - 2 and account.unaccounted == 0, account
        retried = medium.counters()["pairs"]["r1", "ap1"]
        assert retried["data_arrived"] >= MESSAGES and retried["data_lost_set"] <= 3, retried
        medium.lose("ap1", "r2", SHARE)  # group frames, which nobody acknowledges
        again = machine.exchange("r1", ["r2"], MESSAGES, channel="again")["r2"]
    assert again.unaccounted == 0, again
    assert 0.5 * SHARE < again.lost_air / again.sent < 1.6 * SHARE, again


@pytest.mark.parametrize("rate, arrives", [("6", True), ("54", False)])
def test_a_faster_rate_does_not_reach_as_far(machine, daemons, rate, arrives):
    with machine.medium(places={"r2": (60, 0)}) as medium:
        with machine.network("ibss", robots=["r1", "r2"], mcast_rate=rate):
            daemons(["r1", "r2"])
            account = machine.exchange("r1", ["r2"], MESSAGES, expected=arrives)["r2"]
            pair = medium.counters()["pairs"]["r1", "r2"]
    if arrives:
        assert account.heard >= MESSAGES and account.unaccounted == 0, account
    else:
        assert account.heard == 0 and pair["data_lost_weak"] >= account.sent, (account, pair)


def test_the_medium_says_what_it_cannot_do(machine):
    with machine.medium() as medium:
        for line, words in (("place r9 1 1", "no radio 'r9'"), ("fly r1", "no command 'fly'"),
                            ("loss r1 r2 1.5", "loss FROM TO"), ("place r1 1", "place NAME X Y")):
            with pytest.raises(guest.GuestError, match=words):
                medium.ask(line)
    second = machine.start("", guest.program("swarmtalk-wifi-medium"), "1", "r1=nonsense")
    assert second.wait(20) == 1 and "NAME=ADDRESS@X,Y" in second.stderr
