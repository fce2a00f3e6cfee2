"""The whole chain: overhead controller, infrared, nine robots, right hop counts."""
import os
import pathlib
import subprocess
import sys
import time

import pytest

import swarm
from overhead_frames import RUN, forward, stop

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "suite/runner"))
import emulated  # noqa: E402

ROWS = COLUMNS = 3
SPACING_MM = 50
RANGE_MM = 60  # four neighbours
SECONDS = 14


def hops_of(image: str) -> list[str]:
    """What to watch for the hops of seed 1 and seed 2."""
    variables = emulated.variables_of(swarm.image(image))
    return [variables["hops_1"], variables["hops_2"]]


def expected_hops(robot: int, seed: int, other_seed: int) -> int:
    """Steps over the grid. Seeds do not pass on the other's count: the way leads around them."""
    def neighbours(node):
        row, column = divmod(node, COLUMNS)
        for r, c in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            if 0 <= r < ROWS and 0 <= c < COLUMNS:
                yield r * COLUMNS + c

    hops = {seed: 0}
    queue = [seed]
    for node in queue:
        if node == other_seed:
            continue
        for neighbour in neighbours(node):
            if neighbour not in hops:
                hops[neighbour] = hops[node] + 1
                queue.append(neighbour)
    return hops[robot]


# uid 1 (in the middle of the first row) and 2 (a corner) are the seeds of the count.
UIDS = [3, 1, 4, 5, 6, 7, 8, 9, 2]


def nine_robots():
    robots = swarm.grid(ROWS, COLUMNS, SPACING_MM, image=swarm.image("hop_count"))
    for robot, uid in zip(robots, UIDS):
        robot["uid"] = uid
    return robots


def check_hops(log):
    first, second = UIDS.index(1), UIDS.index(2)
    for i in range(ROWS * COLUMNS):
        counts = [log.variable(f"k{i}", name) for name in hops_of("hop_count")]
        assert counts == [0 if i == first else expected_hops(i, first, second),
                          0 if i == second else expected_hops(i, second, first)], f"robot k{i}"


def test_nine_robots_that_run_count_hops(tmp_path):
    log = swarm.emulate(tmp_path, nine_robots(), ohc=swarm.overhead("run@2.1", "stop@3.1"),
                        medium={"range_mm": RANGE_MM}, seconds=SECONDS, seed=1, drift_ppm=10000,
                        watch=hops_of("hop_count"))
    check_hops(log)


@pytest.mark.field
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_run_over_the_terminal_lets_nine_robots_count_hops(tmp_path, seed):
    """In real time, with drifting clocks."""
    robots = nine_robots()
    terminal = tmp_path / "ohc"
    ohc = {"image": swarm.image("overhead"), "infrared_pin": "D3", "pty": str(terminal)}
    scenario = tmp_path / "scenario.toml"
    log_path = tmp_path / "log.jsonl"
    scenario.write_text(swarm.scenario_text(
        robots, {"seconds": SECONDS, "seed": seed, "drift_ppm": 10000,
                 "watch": hops_of("hop_count"),
                 "real_time_factor": 8},
        {"range_mm": RANGE_MM}, ohc))
    emulator = subprocess.Popen([swarm.EMULATOR, "--scenario", scenario, "--log", log_path],
                                stderr=subprocess.PIPE, text=True)
    try:
        press_run(terminal, log_path, emulator)
        assert emulator.wait(timeout=swarm.RUN_SECONDS) == 0
    finally:
        emulator.kill()
    print(emulator.stderr.read().strip())
    log = swarm.Log(log_path.read_text().splitlines())
    assert log.of("sent", "ohc", type=RUN)
    check_hops(log)


def press_run(terminal, log_path, emulator):
    """What an operator does: RUN, again until it is seen to leave, and STOP."""
    while not terminal.exists():
        assert emulator.poll() is None, "the emulator opened no terminal"
        time.sleep(0.01)
    port = os.open(terminal, os.O_RDWR | os.O_NOCTTY)
    try:
        while emulator.poll() is None and log_path.read_text().count('"type":136') < 20:
            os.write(port, forward(RUN))  # bytes before the controller has started are lost
            time.sleep(0.1)
        if emulator.poll() is None:
            os.write(port, stop())
        time.sleep(0.05)
    finally:
        os.close(port)


def test_the_format_of_2020_counts_hops_and_shares_the_air(tmp_path):
    """Two robots with packets of 2020 (message type 0) beside two with ours (type 2)."""
    robots = swarm.grid(2, 2, SPACING_MM)
    kinds = ("hop_count_classic", "hop_count_classic", "hop_count", "hop_count")
    for robot, kind, uid in zip(robots, kinds, (1, 5, 2, 6)):
        robot.update(image=swarm.image(kind), uid=uid)
    log = swarm.emulate(tmp_path, robots, ohc=swarm.overhead("run@2.1", "stop@3.1"), seconds=6,
                        seed=1, drift_ppm=10000, watch=hops_of(kinds[0]) + hops_of(kinds[2]))
    hops = [[log.variable(f"k{i}", name) for name in hops_of(kinds[i])] for i in range(4)]
    assert hops == [[0, 100], [1, 100], [100, 0], [100, 1]], "each format hears its own seed only"
    packets = log.of("sent", "k0", type=0)
    assert packets and all(e["data"].endswith("00") for e in packets)
