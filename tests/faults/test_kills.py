"""Clients, daemons or both are killed at random under traffic: nothing leaks, everybody is back."""
import os
import random
import statistics
import time

import pytest

import swarm

KILLS = int(os.environ.get("SWARMTALK_KILLS", "40"))
SEED = int(os.environ.get("SWARMTALK_SEED", "1"))
BACK_S = 60  # of each client: far more than it needs, since the machine may be busy
# Of the median. That each is back within half a second is so by construction: it tries again at
# least every 250 ms (tests/unit/client_lib/client_backoff_test.cpp), and registers in a few more.
# Here a machine that is busy for a moment would add its own time to some clients', so one late
# client proves nothing; but half of all clients over the whole run are late only when the library
# or the daemon is.
BACK_MEDIAN_MS = 500

pytestmark = pytest.mark.skipif(os.geteuid() != 0, reason="network namespaces need root")


class Ends:
    """Two senders and two listeners on each of two robots."""

    ROLES = [("send", "s1"), ("send", "s2"), ("hear", "h1"), ("hear", "h2")]

    def __init__(self, group):
        self.group = group
        self.running = {}
        self.accounts = {"send": [], "hear": []}
        for robot in range(2):
            for role, name in self.ROLES:
                self.start(robot, role, name)

    def start(self, robot, role, name):
        channel = f"c{name[1]}"
        end = self.group.send(robot, name, channel, 200) if role == "send" else \
            self.group.hear(robot, name, channel)
        self.running[robot, role, name] = end

    def end_all(self):
        for (_, role, _), end in self.running.items():
            self.accounts[role].append(end.end())
        self.running = {}


def wait_until_back(ends, robot, killed_ns, since_ns):
    """@return ms from `since_ns` until each of a robot's surviving clients is registered again"""
    took_ms = []
    for (where, _, name), end in ends.running.items():
        if where != robot:
            continue
        swarm.wait_for(lambda end=end: (end.times_ns("back") or [0])[-1] > killed_ns, BACK_S,
                       f"{name} to be back")
        took_ms.append(max(0, end.times_ns("back")[-1] - since_ns) / 1e6)
    return took_ms


@pytest.mark.field
def test_random_kills(tmp_path):
    chance = random.Random(SEED)
    print(f"seed {SEED}, {KILLS} kills")
    back_ms = []
    with swarm.Swarm(2, tmp_path) as group:
        ends = Ends(group)
        descriptors = [robot.descriptors() for robot in group.robots]
        counts = {"client": 0, "daemon": 0, "both": 0}
        for _ in range(KILLS):
            what = chance.choice(["client", "client", "daemon", "both"])
            robot = chance.randrange(2)
            counts[what] += 1
            victim = None
            if what != "daemon":
                role, name = chance.choice(Ends.ROLES)
                victim = (robot, role, name)
                ends.running.pop(victim).kill()
            if what != "client":
                killed_ns = time.monotonic_ns()
                group.robots[robot].kill_daemon()
                since_ns = group.robots[robot].start_daemon()
                back_ms += wait_until_back(ends, robot, killed_ns, since_ns)
            if victim is not None:
                ends.start(*victim)
        swarm.wait_for(lambda: [robot.descriptors() for robot in group.robots] == descriptors,
                       BACK_S, f"{descriptors} descriptors in the daemons again")
        ends.end_all()
        for robot in group.robots:
            robot.stop_daemon()
        left = {path.name for path in tmp_path.iterdir()}
        assert not any(name.endswith(".sock") for name in left), left
        assert all(traffic.process.poll() is not None for traffic in group.traffic)

    print(f"killed: {counts}")
    print(f"back after the daemon's return, ms: median {statistics.median(back_ms):.0f}, most "
          f"{max(back_ms):.0f}, {sum(ms > 500 for ms in back_ms)} of {len(back_ms)} above 500")
    assert statistics.median(back_ms) < BACK_MEDIAN_MS
    for role, accounts in ends.accounts.items():
        total = {key: sum(account[key] for account in accounts) for key in accounts[0]}
        print(f"{role}: {total}")
    assert all(account["open"] == 0 for account in ends.accounts["send"])
    assert all(account["refused"] == 0 for account in ends.accounts["send"])
    assert sum(account["sent"] for account in ends.accounts["send"]) > 0
    for account in ends.accounts["hear"]:
        assert account["received"] > 0
        assert account["unaccounted"] == 0, account
