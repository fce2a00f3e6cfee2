"""Floods in the air of two robots: each message is heard, once, and nobody takes its own for
another's. What robots do is in their uids; the counters are the images' (tests/kilobot/images).
"""
import pytest

import swarm
from overhead_frames import RESET, RUN, command

SENDS, SLOWLY, ONE_HOP, OWN_ID = 0x100, 0x200, 0x400, 0x800
START = 1.5  # all robots run
IDS_DIFFER = 5.0  # if they did not by chance, they do now
FIRST = 16  # messages after a start that are counted apart
WATCH = {name: f"flooding_{name}:{size}" for name, size in
         {"sent": 2, "heard": 2, "first": 2, "twice": 2, "own_back": 2, "node_id": 1,
          "id_changes": 1}.items()}


def flood(tmp_path, uids, *, seconds: float, seed: int, name: str = "flooding", **options):
    robots = swarm.grid(1, len(uids), 50, image=swarm.image(name))
    for robot, uid in zip(robots, uids):
        robot["uid"] = uid
    return swarm.emulate(tmp_path, robots, lamp=["run@1"], seconds=START + seconds, seed=seed,
                         watch=list(WATCH.values()), **options)


def counted(log, node: str, what: str, start_s: float = 0, end_s: float = float("inf")) -> int:
    """How far a counter of a robot has gone between two times."""
    start = log.variable(node, WATCH[what], start_s) or 0
    return (log.variable(node, WATCH[what], end_s) or 0) - start


def share_heard(log, sender: str, listener: str) -> float:
    """Of a sender's messages, those that a listener has heard."""
    sent = counted(log, sender, "sent", START)
    heard, twice = (counted(log, listener, what, START) for what in ("heard", "twice"))
    print(f"{listener} has heard {heard - twice} of {sent} and {twice} of these again")
    return (heard - twice) / sent


def assert_nobody_is_confused(log, nodes, since_s: float) -> None:
    confused = {what: [counted(log, node, what, since_s) for node in nodes]
                for what in ("own_back", "id_changes", "twice")}
    print(confused)
    assert not any(sum(counts) for counts in confused.values()), confused


@pytest.mark.parametrize("seed", [1, swarm.in_the_field(2), swarm.in_the_field(3)])
def test_a_flood_is_heard_as_fast_as_it_can_leave(tmp_path, seed):
    log = flood(tmp_path, [SENDS | 1, 2], seconds=60, seed=seed)
    assert counted(log, "k0", "sent") > 550  # of 586: a turn each 102 ms
    assert share_heard(log, "k0", "k1") >= 0.98
    assert_nobody_is_confused(log, ["k0", "k1"], IDS_DIFFER)


@pytest.mark.parametrize("seed", [2, swarm.in_the_field(3), swarm.in_the_field(5)])
def test_two_robots_that_flood_tell_their_own_messages_from_others(tmp_path, seed):
    """Each sends and forwards in turn, so half as many messages as above leave each."""
    log = flood(tmp_path, [SENDS | 1, SENDS | 2], seconds=60, seed=seed)
    assert min(counted(log, node, "sent") for node in ("k0", "k1")) > 280
    assert min(share_heard(log, "k0", "k1"), share_heard(log, "k1", "k0")) >= 0.98
    assert_nobody_is_confused(log, ["k0", "k1"], IDS_DIFFER)


def test_the_air_loses_nothing_of_what_does_not_hop(tmp_path):
    log = flood(tmp_path, [SENDS | ONE_HOP | 1, ONE_HOP | 2], seconds=60, seed=1)
    assert share_heard(log, "k0", "k1") >= 0.995


@pytest.mark.parametrize("seed", [1, swarm.in_the_field(2)])
def test_a_flood_with_random_numbers_as_in_2020_is_heard(tmp_path, seed):
    log = flood(tmp_path, [SENDS | SLOWLY | OWN_ID | 1, 2], name="flooding_2020", seconds=200,
                seed=seed)
    assert counted(log, "k0", "sent") > 350
    assert share_heard(log, "k0", "k1") >= 0.95
    assert_nobody_is_confused(log, ["k0", "k1"], IDS_DIFFER)


@pytest.mark.parametrize("pace, between_s", [(0, 4), swarm.in_the_field(SLOWLY, 12)])
def test_the_first_floods_after_a_restart_with_a_fixed_id_are_heard(tmp_path, pace, between_s):
    """An overhead controller whose light reaches only the sender restarts it, again and again."""
    restarts, first_restart = 10, START + between_s
    commands = []
    for restart in range(restarts):
        at = first_restart + restart * between_s
        commands += command(at, RESET, hold=0.3) + command(at + 0.5, RUN, hold=0.3)
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "send": commands,
           "x_mm": -30, "reach_mm": 60}
    log = flood(tmp_path, [SENDS | pace | OWN_ID | 1, 2], seconds=(restarts + 1) * between_s,
                seed=1, ohc=ohc)
    heard = [counted(log, "k1", "first", first_restart + n * between_s + 0.4,
                     first_restart + (n + 1) * between_s) for n in range(restarts)]
    print(f"heard of the first {FIRST} after each restart: {heard}")
    assert sum(heard) >= 0.99 * FIRST * restarts
